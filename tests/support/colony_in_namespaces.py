"""A colony whose every process is a machine of its own on a switch, and what is measured of it when things fail."""

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
    """Those of the robots, in order"""

    def settle(self) -> float:
        """Wait until all is well; return how long it took."""
        begun_s = time.monotonic()
        settle(self.colony, self.view)
        return time.monotonic() - begun_s

    def lose(self, share: float, *, both_ways: bool) -> None:
        """Lose this share of the packets that arrive at the robots, and if both ways, at the arena, too."""
        for host in (self.arena, *self.hosts) if both_ways else self.hosts[::2]:
            host.lose(share)


@contextlib.contextmanager
def cabled(folder: Path, robots: int = 4, hz: float = 30.0) -> Iterator[Cabled]:
    """A colony on a switch of its own; processes and network are gone when this is left."""
    with hosts(1 + robots) as lan, colony(folder) as made:
        made.endpoint = f"tcp/{lan[0].address}:7447"
        made.arena(robots, "--hz", str(hz), before=lan[0].before)
        for host in lan[1:]:
            made.robot("--listen", f"tcp/{host.address}:7450", before=host.before)
        yield Cabled(made, made.observer(before=lan[0].before), lan[0], lan[1:])


@dataclass(frozen=True)
class Fault:
    """Something that happens to a robot, or to the cable of its host, and how it is mended."""

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
    """Return how long after a fault the network says that the robot is gone; it is mended then."""
    robot, host = lan.colony.robots[number], lan.hosts[number]
    name, begun = robot.id.hex(), len(lan.view.update().lines)

    def gone() -> list[float]:
        tokens = lan.view.all(Token, begun)
        return [token.at_s for token in tokens if token.robot == name and not token.there]

    begun_s = time.monotonic()
    fault.happen(robot, host)
    try:
        wait_until(gone, f"a robot is seen to be gone after {fault.name}", 30.0)
    finally:
        fault.mend(robot, host)
    return gone()[0] - begun_s


def outcomes(lan: Cabled, seconds: float) -> Counter[str]:
    """Return what became of the encounters of so many seconds: mated, doubt, orphaned, expired, … as robots said it."""
    before = lan.colony.outcomes()
    time.sleep(seconds)
    return lan.colony.outcomes() - before
