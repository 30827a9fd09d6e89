"""How many robot processes this machine carries at 10 Hz, and what each of them costs.

Run with `make bench`, or `python -m tests.benchmarks.bench_realtime`. A robot is carried if the 99th percentile of its
control periods, from action to action as any subscriber receives them, is within 10 % of the nominal 100 ms.
"""

import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import psutil
import zenoh
from zenoh.handlers import Callback

from crcolony.protocol.key_expressions import ArenaKeys
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import open_session
from tests.benchmarks.processes import ARENA, COLONY, here, start, stop

COLONY_SIZES = (8, 16, 24, 32)
HZ, TARGET, TOLERANCE = 10.0, 16, 0.10
MEASURED_S, SETTLED_S, PATIENCE_S = 6.0, 1.5, 15.0
MIB = 2**20
PARTS = {
    "python with numpy": "import numpy",
    "the control step and all that is imported": "from pathlib import Path;"
    "from crcolony.runtime.start_robot import *; config = Config();"
    "robot = make_robots(config, ['0'], numbered_streams(0, 0, 1));"
    "warm_up(*robot[:2], StartupReport(lambda data: None, print))",
    "a robot's weights": "another = make_robots(config, ['0'], numbered_streams(0, 0, 1))",
    "sqlite": "store = RobotStore(Path(FOLDER) / 'file', bytes(16), bytes(16)); store.begin_incarnation(1)",
    "zenoh": "session = open_session(NetworkSettings(listen=('tcp/127.0.0.1:0',)))",
}


class Periods:
    """Control periods of all robots, by the times at which their actions arrive here."""

    def __init__(self, session: zenoh.Session) -> None:
        self.times: defaultdict[str, list[float]] = defaultdict(list)
        self._subscriber = session.declare_subscriber(
            ArenaKeys(ARENA).all_actions, Callback(self._on_action, indirect=False)
        )

    def _on_action(self, sample: zenoh.Sample) -> None:
        self.times[str(sample.key_expr)].append(time.perf_counter())

    def wait_for(self, robots: int) -> bool:
        """Wait until so many robots act; return whether they do."""
        until_s = time.monotonic() + PATIENCE_S
        while len(self.times) < robots and time.monotonic() < until_s:
            time.sleep(0.1)
        return len(self.times) >= robots

    def measure(self) -> float:
        """Listen for a while; return the 99th percentile of the periods, as a deviation from the nominal one."""
        time.sleep(SETTLED_S)
        since = {key: len(times) for key, times in self.times.items()}
        time.sleep(MEASURED_S)
        periods = np.concatenate([np.diff(self.times[key][first:]) for key, first in since.items()])
        return float(np.quantile(np.abs(periods * HZ - 1.0), 0.99))


def cpu_s(robots: Sequence[subprocess.Popen[bytes]]) -> float:
    """Return what robots have used of a processor so far, on average."""
    return float(np.mean([sum(psutil.Process(r.pid).cpu_times()[:2]) for r in robots]))


def carried(folder: Path) -> int:
    """Add robots in steps; return the largest number that was carried."""
    endpoint, most = here(), 0
    clock = ["--hz", f"{HZ:g}", "--robots", str(COLONY_SIZES[-1])]
    arena = start(folder / "arena.log", ["arena", "--arena", ARENA, *clock, "--listen", endpoint])
    robots: list[subprocess.Popen[bytes]] = []
    try:
        with open_session(NetworkSettings(connect=(endpoint,))) as session:
            periods = Periods(session)
            for size in COLONY_SIZES:
                for number in range(len(robots), size):
                    robots.append(start(folder / f"{number}.log", robot(folder, number, endpoint)))
                if not periods.wait_for(size):
                    print(f"{size} robots: not all alive after {PATIENCE_S:.0f} s")
                    break
                if report(robots, periods) <= TOLERANCE:
                    most = size
    finally:
        stop(robots)
        stop([arena])
    return most


def report(robots: Sequence[subprocess.Popen[bytes]], periods: Periods) -> float:
    """Print what so many robots cost; return how far their periods deviate (99th percentile)."""
    before_s, at_s = cpu_s(robots), time.monotonic()
    deviation = periods.measure()
    share = (cpu_s(robots) - before_s) / (time.monotonic() - at_s)
    infos = [psutil.Process(robot.pid).memory_full_info() for robot in robots]
    rss, pss = (np.mean([getattr(info, kind) for info in infos]) / MIB for kind in ("rss", "pss"))
    print(
        f"{len(robots)} robots at {HZ:g} Hz: period p99 within {100 * deviation:.1f} %, a robot"
        f" takes {100 * share:.1f} % of a core, RSS {rss:.0f} MiB, PSS {pss:.0f} MiB",
        flush=True,
    )
    return deviation


def robot(folder: Path, number: int, endpoint: str) -> list[str]:
    out = str(folder / str(number))
    where = ["--out", out, "--connect", endpoint, "--no-shared-memory"]
    return ["robot", "--arena", ARENA, "--colony", COLONY, *where]


def made_of(folder: Path) -> str:
    """Return what a robot's memory is made of: what each part adds to the RSS of one process."""
    lines = [f"FOLDER = {str(folder)!r}", "import os, re"]
    show = "print(re.search(r'Rss: +(\\d+)', open('/proc/self/smaps_rollup').read())[1])"
    for code in PARTS.values():
        lines += [code, show]
    out = subprocess.run(
        [sys.executable, "-c", "\n".join(lines)], capture_output=True, text=True, check=True
    ).stdout
    sizes = np.diff([0, *(int(size) / 1024 for size in out.split())])
    return ", ".join(f"{name} {size:.0f}" for name, size in zip(PARTS, sizes, strict=True))


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        print(f"a robot's RSS is made of, in MiB: {made_of(Path(folder))}", flush=True)
        most = carried(Path(folder))
    print(f"robot processes carried: {most}  (target {TARGET} on two cores)")


if __name__ == "__main__":
    main()
