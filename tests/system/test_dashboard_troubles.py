"""When a dashboard cannot do what it should: one clear line, nothing lost that can be kept, the colony undisturbed."""

import os
import signal
import socket
from pathlib import Path

import pytest

from crcolony.protocol.key_expressions import ColonyKeys
from crcolony.transport.zenoh_session import NetworkSettings, free_port, open_session
from tests.support.process import Process, wait_until
from tests.support.process_colony import Colony, colony, crcolony

QUICK = ("--no-recording",)


def start(made: Colony, *words: str, port: int | None = None) -> Process:
    """Start a dashboard of a colony that may not be there."""
    port = port or free_port()
    words = (*words, "--connect", made.endpoint, "--port", str(port))
    return made.start(f"dashboard-{len(made.processes)}", "dashboard", *words)


def test_without_a_colony_it_says_so_and_shows_the_one_that_comes(tmp_path: Path) -> None:
    """It looks on; when robots come it says whom it watches, and when they are gone it looks again."""
    with colony(tmp_path) as made:
        dashboard = start(made, *QUICK)
        dashboard.wait_for("no colony on the network yet; waiting")
        made.arena(2, "--hz", "20")
        robot = made.robot()
        dashboard.wait_for("watching colony")
        robot.stop()
        dashboard.wait_for("no colony on the network any more; waiting")
        dashboard.stop()


@pytest.mark.parametrize("option", ["--port", "--web-port"])
def test_a_port_that_is_taken_is_named(tmp_path: Path, option: str) -> None:
    """The line has the port and the option that chooses another; exit code 2."""
    with colony(tmp_path) as made, socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        taken = other.getsockname()[1]
        if option == "--port":
            dashboard = start(made, *QUICK, port=taken)
        else:
            dashboard = start(made, *QUICK, "--web", "--web-port", str(taken))
        assert dashboard.wait(30.0) == 2
        line = dashboard.said.strip().splitlines()[-1]
        assert line == (
            f"crcolony: 127.0.0.1:{taken}: address already in use; choose another with {option}"
        )


def test_on_a_full_disk_it_goes_on_without_recording(tmp_path: Path) -> None:
    """Files may grow to 300 kB here: it says for each that it is not recorded any more, and shows the colony on."""
    small = (
        "import os, resource, sys;"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, resource.RLIM_INFINITY));"
        "os.execv(sys.executable, [sys.executable, '-m', *sys.argv[1:]])"
    )
    with colony(tmp_path) as made:
        made.arena(4, "--hz", "30")
        robots = [made.robot() for _ in range(4)]
        words = crcolony("dashboard", "--port", str(free_port()), "--connect", made.endpoint)
        out = tmp_path / "watched"
        command = [words[0], "-c", small, *words[2:], "--out", str(out)]
        dashboard = Process(command, tmp_path / "dashboard.log").start()
        made.processes.append(dashboard)
        dashboard.wait_for("dashboard.rrd: not recorded any more: ", within_s=60.0)
        dashboard.wait_for("telemetry.sqlite: not recorded any more: ", within_s=60.0)
        assert "Traceback" not in dashboard.said
        robots[0].kill()
        robots[0].start()
        robots[0].wait_for("has body")
        assert dashboard.is_running
        dashboard.stop()
        assert (out / "telemetry.sqlite").stat().st_size <= 300_000


def test_nonsense_on_the_network_is_counted_and_shown_to_nobody(tmp_path: Path) -> None:
    """Bytes that are no telemetry, under every key that it hears, do not end it: it goes on to see robots come."""
    with colony(tmp_path) as made:
        made.arena(2, "--hz", "20")
        dashboard = start(made, "--out", str(tmp_path / "watched"))
        dashboard.wait_for("no colony on the network yet; waiting")
        of = ColonyKeys("colony")
        with open_session(NetworkSettings(connect=(made.endpoint,))) as session:
            for key in (of.state(bytes(16)), of.event(bytes(16)), "crcolony/1/arena/arena/scene"):
                for nonsense in (b"", b"\x93\xa5state", os.urandom(4096), b"\xff" * 300_000):
                    session.put(key, nonsense)
            token = session.liveliness().declare_token("crcolony/1/colony/colony/alive/x/y/z")
            made.robot()
            dashboard.wait_for("watching colony")
            token.undeclare()  # type: ignore[no-untyped-call]
        assert "Traceback" not in dashboard.said
        dashboard.stop()


def test_it_ends_well_when_told_to_and_its_film_is_whole(tmp_path: Path) -> None:
    """SIGTERM with a colony alive: exit code 0 soon, and the film has its footer."""
    with colony(tmp_path) as made:
        made.arena(2, "--hz", "20")
        made.robot()
        dashboard = start(made, "--out", str(tmp_path / "watched"))
        dashboard.wait_for("watching colony")
        rrd = tmp_path / "watched" / "dashboard.rrd"
        wait_until(lambda: rrd.stat().st_size > 50_000, "something is filmed")
        dashboard.signal(signal.SIGTERM)
        assert dashboard.wait(10.0) == 0
    from rerun.chunk import RrdReader

    assert RrdReader(str(rrd)).store() is not None, "only a film with its footer has an index"
