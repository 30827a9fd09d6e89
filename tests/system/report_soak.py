"""A colony for hours with a fault a minute: what every process takes of the machine, and whether it grows.

Run with `python -m tests.system.report_soak --hours 2` (root, Linux). An arena, a router and six robots are on hosts of
their own on a switch. Faults hit three of the robots in turn: kill -9, SIGSTOP, a cable that is cut, a full disk. The
others, the arena, the router and an observer are never touched, and live on beside them; their memory, open files,
threads and disk are the question. The slope of each, with the 95 % interval of a straight line through all samples
after a tenth of the time, is printed at the end, and the ledger of all matings is checked.
"""

import argparse
import contextlib
import itertools
import shutil
import signal
import subprocess
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import psutil
from scipy import stats

from tests.support.mating_audit import check_ledger
from tests.support.namespaces import Host, hosts, run
from tests.support.process import Process, Robot
from tests.support.process_colony import Colony, View, colony, settle

ROBOTS, HIT = 6, 3
PERIOD_S = 60.0
OUTAGE_S = 15.0
SAMPLE_S = 10.0
DISK_MIB = 24


@dataclass
class Samples:
    """What one process takes, by the time."""

    at_s: list[float] = field(default_factory=list)
    values: defaultdict[str, list[float]] = field(default_factory=lambda: defaultdict(list))


class Meter:
    """Samples processes that are never restarted."""

    def __init__(self, processes: dict[str, Process], folders: dict[str, Path]) -> None:
        self._processes, self._folders = processes, folders
        self.samples: defaultdict[str, Samples] = defaultdict(Samples)
        self._started_s = time.monotonic()

    def sample(self) -> None:
        """Sample all of them once."""
        for name, process in self._processes.items():
            assert process.is_running, f"{name} has ended: {process.output[-2000:]}"
            now, own = psutil.Process(process.pid), self.samples[name]
            own.at_s.append(time.monotonic() - self._started_s)
            own.values["memory_mib"].append(now.memory_info().rss / 2**20)
            own.values["open_files"].append(now.num_fds())
            own.values["threads"].append(now.num_threads())
            own.values["log_mib"].append(process.log.stat().st_size / 2**20)
            if name in self._folders:
                own.values["disk_mib"].append(_size_mib(self._folders[name]))

    def report(self) -> None:
        """Print the first and last values, and the slopes of the whole time and of its second half."""
        print(
            f"{'process':<10} {'what':<11} {'first':>8} {'last':>8}   slope an hour (95 %), of the second half"
        )
        for name, samples in self.samples.items():
            for what, values in samples.values.items():
                ends = f"{values[len(values) // 10]:8.1f} {values[-1]:8.1f}"
                slopes = (slope_per_hour(samples.at_s, values, after) for after in (0.1, 0.5))
                shown = "   ".join(f"{slope:+.3f} ± {half:.3f}" for slope, half in slopes)
                print(f"{name:<10} {what:<11} {ends}   {shown}", flush=True)


def slope_per_hour(at_s: list[float], values: list[float], after: float) -> tuple[float, float]:
    """Return the slope of a straight line after this share of the time, and half the width of its 95 % interval."""
    first = int(after * len(at_s))
    x, y = np.array(at_s[first:]) / 3600.0, np.array(values[first:])
    if len(x) < 3 or np.ptp(y) == 0.0:
        return 0.0, 0.0
    line = stats.linregress(x, y)
    return float(line.slope), float(stats.t.ppf(0.975, len(x) - 2) * line.stderr)


def _size_mib(folder: Path) -> float:
    files = (path for path in folder.rglob("*") if path.is_file())
    return sum(path.stat().st_size for path in files) / 2**20


class Faults:
    """Faults of robots, one after the other, each with its repair."""

    def __init__(self, robots: list[tuple[Robot, Host]]) -> None:
        kinds: tuple[tuple[str, Callable[[Robot, Host], Callable[[], object]]], ...] = (
            ("kill -9", self._kill),
            ("SIGSTOP", self._freeze),
            ("cable cut", self._cut),
            ("full disk", self._fill),
        )
        self._next = itertools.cycle(itertools.product(robots, kinds))

    def happen(self) -> None:
        """Let the next fault happen, and mend it after its time."""
        (robot, host), (name, fault) = next(self._next)
        print(f"{time.strftime('%H:%M:%S')} {name}: {robot.folder.name}", flush=True)
        mend = fault(robot, host)
        time.sleep(OUTAGE_S)
        mend()
        if not robot.is_running:  # a disk that is full ends a robot whose state is unknown
            robot.start()

    def _kill(self, robot: Robot, _: Host) -> Callable[[], object]:
        robot.kill()
        return lambda: None

    def _freeze(self, robot: Robot, _: Host) -> Callable[[], object]:
        robot.signal(signal.SIGSTOP)
        return lambda: robot.signal(signal.SIGCONT)

    def _cut(self, _: Robot, host: Host) -> Callable[[], object]:
        host.cut()
        return host.mend

    def _fill(self, robot: Robot, _: Host) -> Callable[[], object]:
        filler = robot.folder / "filler"
        with contextlib.suppress(OSError), filler.open("wb") as file:
            while True:
                file.write(bytes(65_536))
        return filler.unlink


@contextlib.contextmanager
def small_disk(folder: Path) -> Iterator[Path]:
    """A folder on a disk of its own that can be filled."""
    folder.mkdir()
    run("mount", "-t", "tmpfs", "-o", f"size={DISK_MIB}m", "tmpfs", str(folder))
    try:
        yield folder
    finally:
        subprocess.run(["umount", "-l", str(folder)], check=False)


def started(made: Colony, lan: list[Host], disks: list[Path]) -> tuple[dict[str, Process], View]:
    """Start router, arena, robots and an observer; return those that no fault hits."""
    made.endpoint = f"tcp/{lan[0].address}:7447"
    client = ("--client", "--connect", made.endpoint)
    router = made.start("router", "router", "--listen", made.endpoint, before=lan[0].before)
    router.wait_for("router at")
    arena = made.arena(ROBOTS, "--hz", "10", *client, before=lan[1].before)
    for number in range(ROBOTS):
        folder = disks[number] if number < HIT else None
        made.robot(*client, before=lan[2 + number].before, folder=folder)
    view = made.observer(before=lan[0].before)
    untouched: dict[str, Process] = {"router": router, "arena": arena, "observer": view.process}
    untouched |= {f"robot {number}": made.robots[number] for number in range(HIT, ROBOTS)}
    return untouched, view


def soak(hours: float) -> None:
    """Run, and print what was found."""
    with (
        tempfile.TemporaryDirectory() as name,
        contextlib.ExitStack() as disks,
        hosts(2 + ROBOTS) as lan,
        colony(Path(name)) as made,
    ):
        folders = [disks.enter_context(small_disk(Path(name) / f"disk{k}")) for k in range(HIT)]
        untouched, view = started(made, list(lan), folders)
        settle(made, view)
        robots = {f"robot {number}": made.robots[number].folder for number in range(HIT, ROBOTS)}
        meter = Meter(untouched, {"arena": made.folder / "arena", **robots})
        faults = Faults(list(zip(made.robots[:HIT], lan[2:], strict=False)))
        end_s = time.monotonic() + 3600.0 * hours
        fault_due_s = time.monotonic() + PERIOD_S
        count = 0
        while time.monotonic() < end_s:
            meter.sample()
            if time.monotonic() >= fault_due_s:
                fault_due_s += PERIOD_S
                faults.happen()
                count += 1
            time.sleep(SAMPLE_S)
        print(f"{hours:g} h, {count} faults, outcomes {dict(made.outcomes())}")
        meter.report()
        settle(made, view)
        made.finish(view)
        try:
            ledger = check_ledger(made.stores)
        except AssertionError:
            kept = tempfile.mkdtemp(prefix="soak-")
            for number, store in enumerate(made.stores):
                shutil.copy(store, Path(kept) / f"robot{number}.sqlite")
            print(f"the robots' files are kept in {kept}")
            raise
        print(f"the ledger is exact: {ledger}")


def main() -> None:
    """Soak a colony."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--hours", type=float, default=2.0)
    soak(parser.parse_args().hours)


if __name__ == "__main__":
    main()
