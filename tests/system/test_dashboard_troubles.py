"""When a dashboard fails it prints one clear line, keeps what it can, and leaves the colony undisturbed."""

import os
import signal
import socket
from pathlib import Path

import pytest

from crcolony.protocol.key_expressions import ColonyKeys
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import free_port, open_session
from tests.support.process import Process, wait_until
from tests.support.process_colony import Colony, colony, crcolony

QUICK = ("--no-recording",)


def start(made: Colony, *words: str, port: int | None = None) -> Process:
    """Start a dashboard of a colony that may be offline."""
    port = port or free_port()
    arguments = (*words, "--connect", made.endpoint, "--port", str(port))
    return made.start(f"dashboard-{len(made.processes)}", "dashboard", *arguments)


def test_without_a_colony_it_waits_for_one(tmp_path: Path) -> None:
    """It prints when a colony is online, and when none is any more."""
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
def test_a_port_that_is_taken_is_reported(tmp_path: Path, option: str) -> None:
    """With the option that chooses another one, and exit code 2."""
    with colony(tmp_path) as made, socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        taken = other.getsockname()[1]
        if option == "--port":
            dashboard = start(made, *QUICK, port=taken)
        else:
            dashboard = start(made, *QUICK, "--web", "--web-port", str(taken))
        assert dashboard.wait(30.0) == 2
        line = dashboard.output.strip().splitlines()[-1]
        assert line == (
            f"crcolony: 127.0.0.1:{taken}: address already in use; choose another with {option}"
        )


def test_on_a_full_disk_it_continues_without_recording(tmp_path: Path) -> None:
    """Files may grow to 300 kB here: it reports each that is not recorded any more, and continues."""
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
        assert "Traceback" not in dashboard.output
        robots[0].kill()
        robots[0].start()
        robots[0].wait_for("has body")
        assert dashboard.is_running
        dashboard.stop()
        assert (out / "telemetry.sqlite").stat().st_size <= 300_000


def test_malformed_telemetry_does_not_stop_it(tmp_path: Path) -> None:
    """Neither on any key that it subscribes to, nor as a token: afterwards it still notices a new robot."""
    with colony(tmp_path) as made:
        made.arena(2, "--hz", "20")
        dashboard = start(made, "--out", str(tmp_path / "watched"))
        dashboard.wait_for("no colony on the network yet; waiting")
        keys = ColonyKeys("colony")
        with open_session(NetworkSettings(connect=(made.endpoint,))) as session:
            for key in (
                keys.state(bytes(16)),
                keys.event(bytes(16)),
                "crcolony/1/arena/arena/scene",
            ):
                for payload in (b"", b"\x93\xa5state", os.urandom(4096), b"\xff" * 300_000):
                    session.put(key, payload)
            token = session.liveliness().declare_token("crcolony/1/colony/colony/alive/x/y/z")
            made.robot()
            dashboard.wait_for("watching colony")
            token.undeclare()  # type: ignore[no-untyped-call]
        assert "Traceback" not in dashboard.output
        dashboard.stop()


def test_after_sigterm_its_recording_is_complete(tmp_path: Path) -> None:
    """With a colony online: exit code 0 soon, and the recording has its footer."""
    with colony(tmp_path) as made:
        made.arena(2, "--hz", "20")
        made.robot()
        dashboard = start(made, "--out", str(tmp_path / "watched"))
        dashboard.wait_for("watching colony")
        rrd = tmp_path / "watched" / "dashboard.rrd"
        wait_until(lambda: rrd.stat().st_size > 50_000, "something is recorded")
        dashboard.signal(signal.SIGTERM)
        assert dashboard.wait(10.0) == 0
    from rerun.chunk import RrdReader

    assert RrdReader(str(rrd)).store() is not None, "only a recording with a footer has an index"
