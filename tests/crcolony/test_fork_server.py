"""What is forked begins when the launch knows of it, and never without a launch."""

import contextlib
import json
import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import psutil
import pytest

from tests.support.process import wait_until

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="nothing is forked here")


@pytest.fixture
def channel() -> Iterator[socket.socket]:
    """The socket of a prepared process, which ends when this is closed."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    command = [sys.executable, "-m", "crcolony.fork_server", str(theirs.fileno())]
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1"}
    with subprocess.Popen(command, pass_fds=[theirs.fileno()], env=environment) as server:
        theirs.close()
        with ours:
            ours.settimeout(60.0)
            yield ours
        assert server.wait(30.0) == 0


def ask(channel: socket.socket, log: Path, *words: str) -> tuple[int, int]:
    """Ask for a process; return its id and the other end of its standard input."""
    reader, writer = os.pipe()
    with log.open("ab") as output:
        request = json.dumps(words).encode()
        socket.send_fds(channel, [request], [reader, output.fileno()])
    os.close(reader)
    return int(channel.recv(32)), writer


def is_running(pid: int) -> bool:
    """Return whether there is a process with this id that has not exited."""
    with contextlib.suppress(psutil.NoSuchProcess):
        return psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    return False


def has_open(pid: int, *descriptors: str) -> bool:
    """Return whether a process has these descriptors open, and no others."""
    return set(os.listdir(f"/proc/{pid}/fd")) == set(descriptors)


def test_a_process_begins_when_it_is_told_to(channel: socket.socket, tmp_path: Path) -> None:
    """The launch, which tells it, knows its id by then."""
    log = tmp_path / "log"
    pid, writer = ask(channel, log, "--version")
    assert is_running(pid)
    assert not log.read_text()
    os.write(writer, b"\n")
    wait_until(lambda: log.read_text().startswith("crcolony "), "it has begun")
    os.close(writer)


def test_a_process_never_begins_when_the_launch_is_gone(
    channel: socket.socket, tmp_path: Path
) -> None:
    """It exits: a launch that does not know it may have started another one in its place."""
    log = tmp_path / "log"
    pid, writer = ask(channel, log, "--version")
    os.close(writer)
    wait_until(lambda: not is_running(pid), "it has exited")
    assert not log.read_text()


def test_many_processes_leave_nothing_open(channel: socket.socket, tmp_path: Path) -> None:
    """Each has its standard streams, and none those of others."""
    for _ in range(3):
        pid, writer = ask(channel, tmp_path / "log", "--version")
        wait_until(partial(has_open, pid, "0", "1", "2"), "all else is closed")
        os.close(writer)
