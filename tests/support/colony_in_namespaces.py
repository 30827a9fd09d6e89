"""A colony whose every process runs on a host of its own on a switch, and how it reacts to faults."""

import contextlib
import signal
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from tests.support.namespaces import Host, hosts
from tests.support.observer import Token
from tests.support.process import Robot, wait_until
from tests.support.process_colony import Colony, View, colony, settle


@dataclass(frozen=True)
class Cabled:
    """An arena and an observer on the first host, a robot on each of the others."""

    colony: Colony
    view: View
    arena: Host
    hosts: Sequence[Host]
    """Of the robots, in order"""

    def settle(self) -> float:
        """Wait until all robots are connected and settled; return how long it took (s)."""
        started_s = time.monotonic()
        settle(self.colony, self.view)
        return time.monotonic() - started_s

    def lose(self, share: float, *, both_ways: bool) -> None:
        """Drop this share of the packets that arrive at every second robot; both ways: at all, and at the arena."""
        for host in (self.arena, *self.hosts) if both_ways else self.hosts[::2]:
            host.lose(share)


@contextlib.contextmanager
def cabled(folder: Path, robots: int = 4, hz: float = 30.0) -> Iterator[Cabled]:
    """A colony on a switch of its own; processes and network are removed at the end of the context."""
    with hosts(1 + robots) as lan, colony(folder) as made:
        made.endpoint = f"tcp/{lan[0].address}:7447"
        made.arena(robots, "--hz", str(hz), before=lan[0].before)
        for host in lan[1:]:
            made.robot("--listen", f"tcp/{host.address}:7450", before=host.before)
        yield Cabled(made, made.observer(before=lan[0].before), lan[0], lan[1:])


@dataclass(frozen=True)
class Fault:
    """A fault of a robot, or of the cable of its host, and its repair."""

    name: str
    happen: Callable[[Robot, Host], None]
    mend: Callable[[Robot, Host], object]


FAULTS = (
    Fault("kill -9", lambda robot, host: robot.kill(), lambda robot, host: robot.start()),
    Fault(
        "SIGSTOP",
        lambda robot, host: robot.signal(signal.SIGSTOP),
        lambda robot, host: robot.signal(signal.SIGCONT),
    ),
    Fault("cable cut", lambda robot, host: host.cut(), lambda robot, host: host.mend()),
)


def detection_s(lan: Cabled, fault: Fault, number: int) -> float:
    """Inject a fault, and return after how long (s) the robot's token goes; the fault is repaired then."""
    robot, host = lan.colony.robots[number], lan.hosts[number]
    name, first_line = robot.id.hex(), len(lan.view.update().lines)

    def times_offline() -> list[float]:
        tokens = lan.view.all(Token, first_line)
        return [token.at_s for token in tokens if token.robot == name and not token.is_online]

    started_s = time.monotonic()
    fault.happen(robot, host)
    try:
        wait_until(times_offline, f"a robot is offline after {fault.name}", 30.0)
    finally:
        fault.mend(robot, host)
    return times_offline()[0] - started_s


def outcomes(lan: Cabled, seconds: float) -> Counter[str]:
    """Return how many encounters of so many seconds had each outcome: mated, doubt, orphaned, expired, …"""
    before = lan.colony.outcomes()
    time.sleep(seconds)
    return lan.colony.outcomes() - before
