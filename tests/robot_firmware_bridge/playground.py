"""Aseba's own simulator, `asebaplayground`: nobody of us wrote it, and it speaks the real robots' protocol.

It hangs if a client leaves and connects again within one of its steps (30 ms): tests let a step pass.
"""

import os
import shutil
import signal
import socket
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.support.process import wait_until

needs_playground = pytest.mark.skipif(
    shutil.which("asebaplayground") is None, reason="apt-get install aseba"
)
needs_socat = pytest.mark.skipif(shutil.which("socat") is None, reason="apt-get install socat")

_START_S = 10.0


@dataclass(frozen=True)
class PlacedRobot:
    """A robot in the simulated world; lengths in centimetres, as the simulator has them."""

    kind: str
    x_cm: float
    y_cm: float
    port: int
    angle_rad: float = 0.0
    node: int = 1

    @property
    def address(self) -> str:
        """Where it can be reached."""
        return f"tcp:127.0.0.1:{self.port}"

    @property
    def uid(self) -> str:
        """What our driver names it."""
        return f"{'thymio' if self.kind == 'thymio2' else self.kind}-{self.node}"

    @property
    def xml(self) -> str:
        """Its line in the world's file."""
        return (
            f'<robot type="{self.kind}" port="{self.port}" x="{self.x_cm}" y="{self.y_cm}"'
            f' angle="{self.angle_rad}" nodeId="{self.node}" name="{self.kind}{self.port}"/>'
        )


class Playground:
    """A world with robots, in a process of its own."""

    def __init__(self, folder: Path, robots: Sequence[PlacedRobot], things: str = "") -> None:
        self._folder, self._robots = folder, robots
        self._file = folder / "world.playground"
        body = "".join(robot.xml for robot in robots)
        self._file.write_text(
            '<!DOCTYPE aseba-playground><aseba-playground><color name="red" r="0.9" g="0" b="0"/>'
            f'<world w="400" h="400"/>{things}{body}</aseba-playground>'
        )
        self.start()

    def start(self) -> None:
        """Start it, and return when every robot can be reached."""
        folder = str(self._folder)  # it writes settings and memory cards into the home folder
        self._process = subprocess.Popen(
            ["asebaplayground", str(self._file)],
            env={
                "PATH": os.environ["PATH"],
                "HOME": folder,
                "XDG_RUNTIME_DIR": folder,
                "QT_QPA_PLATFORM": "offscreen",
            },
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        for robot in self._robots:
            wait_for_port(robot.port, lambda: self._process.poll() is None)

    def freeze(self) -> None:
        """Let it do nothing any more, its connections stay."""
        self._process.send_signal(signal.SIGSTOP)

    def end(self) -> None:
        """End it as when its power is cut."""
        self._process.kill()
        self._process.wait()


@contextmanager
def playground(robots: Sequence[PlacedRobot], things: str = "") -> Iterator[Playground]:
    """Run a simulated world inside the context."""
    with tempfile.TemporaryDirectory(prefix="playground-") as folder:
        world = Playground(Path(folder), robots, things)
        try:
            yield world
        finally:
            world.end()


def free_port() -> int:
    """Return a port on which nobody listens."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def wait_for_port(port: int, is_running: Callable[[], bool] = lambda: True) -> None:
    """Wait until a port of this machine listens, without connecting: a client would take a robot over."""
    wanted = f":{port:04X}"

    def listens() -> bool:
        assert is_running(), "it has ended"
        lines = Path("/proc/net/tcp").read_text().splitlines()[1:]
        return any(line.split()[1].endswith(wanted) and line.split()[3] == "0A" for line in lines)

    wait_until(listens, f"port {port} listens", within_s=_START_S)
