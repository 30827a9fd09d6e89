"""Services listen where their options say, and nowhere else."""

import os
import pwd
from pathlib import Path

import pytest
from crcolony_deploy.doctor import ports
from crcolony_deploy.doctor.ports import check_ports

from tests.support.examined_hosts import host_of, lines, service

ROUTER = service("router", "west", "--listen tcp/10.0.0.1:7447")


def write_sockets(folder: Path, *sockets: tuple[str, int, int]) -> None:
    """Write /proc/net/tcp with listening sockets: address, port and user."""
    net = folder / "proc/net"
    net.mkdir(parents=True)
    rows = [
        f"   0: {address}:{port:04X} 00000000:0000 0A 00000000:00000000 00:00000000 00000000 {uid} 0 1"
        for address, port, uid in sockets
    ]
    (net / "tcp").write_text("\n".join(["  sl  local_address …", *rows]) + "\n")


@pytest.fixture(autouse=True)
def _user(monkeypatch: pytest.MonkeyPatch) -> None:
    """The services' user is this one."""
    monkeypatch.setattr(ports, "USER", pwd.getpwuid(os.getuid()).pw_name)


def test_a_service_that_listens_is_well(tmp_path: Path) -> None:
    """On its own address."""
    write_sockets(tmp_path, ("0100000A", 7447, os.getuid()), ("0100000A", 22, 12345))
    assert lines(check_ports(host_of(tmp_path, ROUTER))) == ["ok: port 7447: router-west listens"]


def test_a_service_that_does_not_listen_is_a_problem(tmp_path: Path) -> None:
    """Nobody reaches it."""
    write_sockets(tmp_path)
    assert lines(check_ports(host_of(tmp_path, ROUTER))) == [
        "problem: port 7447: router-west does not listen there"
    ]


def test_a_port_that_another_program_has_is_a_problem(tmp_path: Path) -> None:
    """Of another user."""
    write_sockets(tmp_path, ("0100000A", 7447, 12345))
    assert lines(check_ports(host_of(tmp_path, ROUTER))) == [
        "problem: port 7447 of router-west is taken by another program"
    ]


def test_a_port_that_no_option_names_is_noticed(tmp_path: Path) -> None:
    """And one that is open on all interfaces."""
    write_sockets(tmp_path, ("00000000", 7447, os.getuid()), ("0100000A", 9999, os.getuid()))
    assert lines(check_ports(host_of(tmp_path, ROUTER)))[1:] == [
        "warning: port 7447 is open on all interfaces",
        "warning: port 9999: a service listens there, which no option says",
    ]
