"""Multicast is tried on the interfaces that services use."""

from pathlib import Path

import pytest
from crcolony_deploy.doctor import multicast
from crcolony_deploy.doctor.multicast import check_multicast

from tests.support.examined_hosts import host_of, lines, service
from tests.support.namespaces import hosts, needs_namespaces


def test_an_interface_that_is_not_there_is_a_problem(tmp_path: Path) -> None:
    """Its name is said."""
    host = host_of(tmp_path, service("robot", "ada", "--interface none0"))
    (found,) = lines(check_multicast(host))
    assert found.startswith("problem: interface none0: No such device")


def test_without_interfaces_nothing_is_tried(tmp_path: Path) -> None:
    """Peers with seeds do without."""
    assert lines(check_multicast(host_of(tmp_path, service("robot", "ada")))) == []


@needs_namespaces
def test_a_datagram_comes_back_until_a_firewall_drops_it(tmp_path: Path) -> None:
    """On a real interface, in a process of its namespace."""
    import subprocess
    import sys

    from tests.support.namespaces import run
    from tests.support.process_colony import ROOT

    script = (
        "from pathlib import Path\n"
        "from crcolony_deploy.doctor.multicast import check_multicast\n"
        "from tests.support.examined_hosts import host_of, lines, service\n"
        "host = host_of(Path('.'), *[service('robot', n, '--interface eth0') for n in ('a', 'b')])\n"
        "print(*lines(check_multicast(host)))"
    )

    def examine() -> str:
        from tests.support.command_line import ENVIRONMENT

        words = [*lan.before, sys.executable, "-c", script]
        done = subprocess.run(
            words, capture_output=True, text=True, timeout=60, cwd=ROOT, env=ENVIRONMENT
        )
        return done.stdout + done.stderr

    with hosts(1) as (lan,):
        assert examine() == "ok: multicast works on eth0 (10.0.0.1)\n"
        run(*lan.before, "iptables", "-A", "INPUT", "-d", "224.0.0.0/4", "-j", "DROP")
        assert (
            "problem: multicast on eth0 does not work: a datagram to a group does not come back"
            in examine()
        )


def test_a_network_in_which_nobody_answers_is_a_warning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Multicast works here, and may be filtered on the way."""
    monkeypatch.setattr(multicast, "address_of_interface", lambda name: "10.0.0.1")
    monkeypatch.setattr(multicast, "_reason_unheard", lambda address: "")
    host = host_of(tmp_path, service("robot", "ada", "--interface eth0"))
    assert lines(check_multicast(host)) == [
        "ok: multicast works on eth0 (10.0.0.1)",
        "warning: nobody answers on eth0",
    ]
