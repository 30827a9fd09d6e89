"""The clock of a machine jumps, as when somebody sets it: nothing moves because of it, and nothing is lost."""

import shutil
import subprocess
import time
from pathlib import Path

import pytest

from tests.robot_firmware_bridge.emulated_robot import AvrRobot
from tests.robot_firmware_bridge.firmware import needs_avr
from tests.support.mating_audit import check_ledger
from tests.support.process_colony import colony

DAY_S = 86_400
needs_compiler = pytest.mark.skipif(
    shutil.which("cc") is None, reason="there is no C compiler (Debian: gcc libc6-dev)"
)


class WallClock:
    """The wall clock of processes that are started `through` it; their monotonic clock is the machine's."""

    def __init__(self, folder: Path) -> None:
        library, self._offset = folder / "wall_clock.so", folder / "offset"
        source = Path(__file__).with_name("wall_clock.c")
        subprocess.run(["cc", "-shared", "-fPIC", "-O1", "-o", library, source], check=True)
        self._offset.write_bytes(bytes(8))
        self.through = ("env", f"LD_PRELOAD={library}", f"WALL_CLOCK_OFFSET={self._offset}")

    def set(self, offset_s: int) -> None:
        """Let it differ from the machine's by this much from now on."""
        with self._offset.open("r+b") as file:
            file.write(offset_s.to_bytes(8, "little", signed=True))


@needs_compiler
def test_the_wall_clock_of_a_process_can_be_set(tmp_path: Path) -> None:
    """Otherwise the next test would show nothing."""
    clock = WallClock(tmp_path)
    clock.set(-DAY_S)
    date = subprocess.run([*clock.through, "date", "+%s"], capture_output=True, check=True)
    assert abs(int(date.stdout) + DAY_S - time.time()) < 60


@needs_avr
@needs_compiler
def test_a_colony_lives_on_when_the_clock_jumps(tmp_path: Path) -> None:
    """A day ahead, and two days back: simulated and attached bodies go on, and the ledgers of matings agree."""
    clock = WallClock(tmp_path)
    with AvrRobot(tmp_path, "robot") as emulated, colony(tmp_path) as made:
        arena = made.arena(2, "--hz", "20", before=clock.through)
        attached = ("--robot", f"firmware@{emulated.host_link}", "--arena", "lab")
        options = ("bridge", *attached, "--connect", made.endpoint)
        bridge = made.start("bridge", *options, before=clock.through)
        bridge.wait_for("bridge lab with 1 robots")
        made.robot("--arena", "lab", before=clock.through).wait_for("has body 0")
        for _ in range(2):
            made.robot(before=clock.through)
        view = made.observer()
        view.wait_for_matings(2)
        for offset_s in (DAY_S, -DAY_S):
            clock.set(offset_s)
            view.wait_for_matings(4)
            emulated.wait_for(r"wheels .*[1-9]", since=len(emulated.lines))
        assert "lost" not in bridge.output
        made.stop_robots()
        arena.stop()
        bridge.stop()
        check_ledger(made.stores)
