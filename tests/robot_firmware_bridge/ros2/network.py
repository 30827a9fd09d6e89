"""The programs that a driver meets: a router and a simulated base, each its own process."""

import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from tests.robot_firmware_bridge.playground import free_port
from tests.robot_firmware_bridge.printed_lines import LineProcess
from tests.support.paths import PYTHONPATH, ROOT

NAMESPACE = "robot1"


class Program(LineProcess):
    """A running module of this folder that prints lines, `ready` first, and reads some."""

    def __init__(self, module: str, *arguments: str) -> None:
        super().__init__()
        self._command = [sys.executable, "-m", f"{__package__}.{module}", *arguments]
        self.start()

    def start(self) -> None:
        """Start it, or start it again; what it has printed before is forgotten."""
        self.lines = []
        self._begin(
            subprocess.Popen(
                self._command,
                cwd=ROOT,
                env={"PYTHONPATH": PYTHONPATH},
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
                bufsize=1,
            )
        )
        self.wait_for("ready")

    def signal(self, number: signal.Signals) -> None:
        """Send it a signal."""
        self._process.send_signal(number)


class Network:
    """A router, and one base that has joined it."""

    def __init__(self) -> None:
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        self.address = f"{self.endpoint}/{NAMESPACE}"
        self.router = Program("router", self.endpoint)
        self.base = Program("simulated_base", self.endpoint, NAMESPACE, "Twist")

    def stopped_s(self, reason: str, since: int = 0) -> float:
        """Wait until the wheels stop for a reason; return when that was, by the monotonic clock."""
        pattern = rf"wheels -?0\.0000 -?0\.0000 at (\S+) because {reason}"
        return float(self.base.wait_for(pattern, since=since)[1])

    def started_s(self, since: int = 0) -> float:
        """Wait until the wheels turn; return when that was."""
        pattern = r"wheels (?!-?0\.0000 -?0\.0000)\S+ \S+ at (\S+) because commanded"
        return float(self.base.wait_for(pattern, since=since)[1])


@contextmanager
def network() -> Iterator[Network]:
    """Run a router and a base inside the context."""
    made = Network()
    try:
        yield made
    finally:
        made.base.kill()
        made.router.kill()
