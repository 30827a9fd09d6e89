"""One colony in four kinds of bodies: an arena's, Aseba e-pucks, emulated firmware with infrared, and a ROS 2 base.

Every robot is the same unchanged process. Those mate whose bodies can meet: in the arena, and by infrared.
`python -m tests.system.test_mixed_colony` runs it for longer, and prints who has mated with whom.
"""

import contextlib
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from tests.robot_firmware_bridge.emulated_robot import AvrRobot
from tests.robot_firmware_bridge.firmware import needs_avr
from tests.robot_firmware_bridge.ir_air import IrAir
from tests.robot_firmware_bridge.playground import (
    PlacedRobot,
    free_port,
    needs_playground,
    playground,
)
from tests.robot_firmware_bridge.ros2.network import NAMESPACE, Program
from tests.support.mating_audit import check_ledger
from tests.support.process import Robot, wait_until
from tests.support.process_colony import Colony, View, colony

pytestmark = [needs_avr, needs_playground]

FEEDERS = "".join(f'<feeder x="{x}" y="{y}"/>' for x, y in ((160, 200), (240, 200), (200, 160)))


@dataclass
class Mixed:
    """A colony, with its robots by the kind of their bodies."""

    made: Colony
    view: View
    robots: dict[str, list[Robot]] = field(default_factory=dict)

    def matings_between(self) -> Counter[tuple[str, str]]:
        """Return how many matings both robots of which two kinds have printed."""
        kinds = {robot.id: kind for kind, robots in self.robots.items() for robot in robots}
        names = {robot.hex()[:8]: kind for robot, kind in kinds.items()}
        sides: Counter[tuple[str, str]] = Counter()
        for kind, robots in self.robots.items():
            for robot in robots:
                for line in robot.log.read_text().splitlines():
                    if line.startswith("mated with "):
                        one, other = sorted((kind, names[line.split()[2].rstrip(",")]))
                        sides[one, other] += 1
        return Counter({pair: sides[pair] // 2 for pair in sides})


@contextlib.contextmanager
def mixed_colony(folder: Path) -> Iterator[Mixed]:
    """Run one inside the context; all of its robots have bodies."""
    with contextlib.ExitStack() as opened:
        made = opened.enter_context(colony(folder))
        made.arena(2, "--hz", "20")
        pucks = [PlacedRobot("e-puck", 180.0 + 40 * k, 200.0, free_port()) for k in range(2)]
        opened.enter_context(playground(pucks, FEEDERS))
        boards = [opened.enter_context(AvrRobot(folder, f"board-{k}", k + 1)) for k in range(2)]
        air = IrAir([board.ir_link for board in boards])
        opened.callback(air.close)
        endpoint = f"tcp/127.0.0.1:{free_port()}"
        opened.callback(Program("router", endpoint).kill)
        opened.callback(Program("simulated_base", endpoint, NAMESPACE, "Twist").kill)
        served = {
            "e-puck": [f"aseba@{puck.address}" for puck in pucks],
            "firmware": [f"firmware@{board.host_link}" for board in boards],
            "ros2": [f"ros2@{endpoint}/{NAMESPACE}"],
        }
        for kind, names in served.items():
            options = [option for name in names for option in ("--robot", name)]
            bridge = made.start(
                kind, "bridge", *options, "--arena", kind, "--connect", made.endpoint
            )
            bridge.wait_for(f"bridge {kind} with")
        mixed = Mixed(made, made.observer())
        for kind, count in (("arena", 2), *((kind, len(names)) for kind, names in served.items())):
            mixed.robots[kind] = [made.robot("--arena", kind) for _ in range(count)]
        wait_until(
            lambda: mixed.view.are_connected(made.ids), "all have bodies and are peers", 200.0
        )
        yield mixed


def test_one_colony_lives_in_four_kinds_of_bodies_and_mates_where_they_meet(tmp_path: Path) -> None:
    """And nowhere else: a contact is what both bodies have sensed."""
    with mixed_colony(tmp_path) as mixed:
        wait_until(
            lambda: {("arena", "arena"), ("firmware", "firmware")} <= set(mixed.matings_between()),
            "matings of both kinds that can meet",
            200.0,
        )
        assert set(mixed.matings_between()) == {("arena", "arena"), ("firmware", "firmware")}
        ticks = {state.robot: state.tick for state in mixed.view.fresh(mixed.made.ids)}
        wait_until(
            lambda: all(
                state.tick > ticks.get(state.robot, 0) + 10
                for state in mixed.view.fresh(mixed.made.ids)
            ),
            "all live on",
        )
        mixed.made.stop_robots()
        check_ledger(mixed.made.stores, is_settled=False)


def report(minutes: float) -> None:
    """Run a mixed colony, and print who has mated with whom."""
    with tempfile.TemporaryDirectory() as folder, mixed_colony(Path(folder)) as mixed:
        time.sleep(60.0 * minutes)
        matings = mixed.matings_between()
        kinds = list(mixed.robots)
        print(f"{'':10}" + "".join(f"{kind:>10}" for kind in kinds))
        for kind in kinds:
            counts = (matings[min(kind, other), max(kind, other)] for other in kinds)
            print(f"{kind:10}" + "".join(f"{count:10}" for count in counts))


if __name__ == "__main__":
    report(float(sys.argv[1]) if len(sys.argv) > 1 else 5.0)
