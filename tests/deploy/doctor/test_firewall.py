"""Endpoints that do not answer are named, and so is a firewall that drops what it does not know."""

import socket
from pathlib import Path

import pytest
from crcolony_deploy.doctor.firewall import check_firewall

from tests.support.examined_hosts import answer, host_of, lines, service


def test_endpoints_are_tried(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One answers, then it does not."""
    answer(monkeypatch, tmp_path, "iptables", "-P INPUT ACCEPT")
    with socket.create_server(("127.0.0.1", 0)) as listening:
        port = listening.getsockname()[1]
        host = host_of(tmp_path, service("robot", "ada", f"--connect tcp/127.0.0.1:{port}"))
        assert lines(check_firewall(host)) == ["ok: 1 endpoints answer"]
    (found,) = lines(check_firewall(host))
    assert found.startswith("problem: ")
    assert f"tcp/127.0.0.1:{port} (connection refused)" in found


@pytest.mark.parametrize(
    ("rules", "count"),
    [
        ("-P INPUT DROP", 1),
        ("-P INPUT DROP\n-A INPUT -p tcp -m tcp --dport 7447 -j ACCEPT", 0),
        ("-P INPUT DROP\n-A INPUT -p tcp -m multiport --dports 22,7447 -j ACCEPT", 0),
        ("-P INPUT ACCEPT", 0),
    ],
)
def test_a_firewall_needs_a_rule_for_a_port(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rules: str, count: int
) -> None:
    """If it drops what it does not know."""
    answer(monkeypatch, tmp_path, "iptables", rules)
    host = host_of(tmp_path, service("arena", "pond", "--listen tcp/10.0.0.1:7447"))
    assert len(lines(check_firewall(host))) == count
