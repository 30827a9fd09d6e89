"""What a robot needs of a disk and of a processor in a day, with the default settings.

Run with `make bench`, or `python -m tests.benchmarks.bench_retention [MINUTES]`.

Disk: a colony of four lives in lockstep, as fast as possible, for days of its own time. Once 1,000 encounters are kept
as a whole, with two snapshots, what grows is lineage and the short rows of older encounters: that growth, by ticks of
0.2 s, is given for a day and a year. It assumes that robots mate as often as these do.
Processor, writes, logs and telemetry: four robot processes live in real time, at 5 Hz; a minute counts for a day.
"""

import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import psutil

from crcolony.config import load
from crcolony.storage.compaction import FULL_ENCOUNTERS
from crcolony.storage.robot_copy import CopiedRobot, copy_robot_file
from crcolony.telemetry.subscriber import TelemetrySubscriber
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import open_session
from tests.benchmarks.processes import ARENA, COLONY, commands, here, start, stop

ROBOTS, MINUTES, SAMPLE_S = 4, 3.0, 10.0
REAL_TIME_S, SETTLED_S = 60.0, 10.0
DAY_S, MB = 86_400.0, 1e6


def files_of(folder: Path, scratch: Path) -> tuple[float, float, CopiedRobot]:
    """Return the robots' mean tick and file size, and the last robot, at this moment."""
    sizes, ticks = [], []
    for path in sorted(folder.glob("robots/*/robot.sqlite")):
        scratch.unlink(missing_ok=True)
        robot = copy_robot_file(path, scratch)
        sizes.append(scratch.stat().st_size)
        ticks.append(robot.tick)
    return sum(ticks) / len(ticks), sum(sizes) / len(sizes), robot


def disk(folder: Path, minutes: float) -> None:
    """Print how the files of robots grow over days of their own time."""
    period_s = load(None, []).arena.control_period_s
    run = ["host", "-n", str(ROBOTS), "--lockstep", "--no-plots", "--out", str(folder / "run")]
    samples: list[tuple[float, float, int]] = []
    with commands(folder / "logs", [*run, "--listen", here()]) as (process,):
        until_s = time.monotonic() + 60.0 * minutes
        while time.monotonic() < until_s and process.poll() is None:
            time.sleep(SAMPLE_S)
            if any(folder.glob("run/robots/*/robot.sqlite")):
                tick, size, robot = files_of(folder / "run", folder / "copy")
                samples.append((tick * period_s / DAY_S, size, robot.encounters))
    if robot.encounters <= FULL_ENCOUNTERS:
        print("too few encounters to say how a file grows: give it more minutes")
        return
    (first_days, first), (days, size) = (
        next(s for s in samples if s[2] > FULL_ENCOUNTERS)[:2],
        samples[-1][:2],
    )
    daily, encounters = (size - first) / (days - first_days), robot.encounters / days
    print(
        f"a robot's file after {first_days:.1f} days {first / MB:.1f} MB, after {days:.1f} days {size / MB:.1f} MB:"
    )
    print(
        f"  {daily / MB:.2f} MB a day, {365 * daily / MB:.0f} MB a year, of {encounters:.0f} encounters a day"
    )


def real_time(folder: Path) -> None:
    """Print what robot processes use in a minute of real time, for a day."""
    endpoint = here()
    arena = start(
        folder / "arena.log",
        ["arena", "--arena", ARENA, "--robots", str(ROBOTS), "--listen", endpoint],
    )
    robots: list[subprocess.Popen[bytes]] = []
    try:
        for number in range(ROBOTS):
            options = ["--arena", ARENA, "--colony", COLONY, "--out", str(folder / str(number))]
            robots.append(
                start(folder / f"{number}.log", ["robot", *options, "--connect", endpoint])
            )
        with open_session(NetworkSettings(connect=(endpoint,))) as session:
            watched = TelemetrySubscriber(session, COLONY)
            while (
                sum(s.state is not None and bool(s.state.arena) for s in watched.monitor.alive)
                < ROBOTS
            ):
                time.sleep(0.1)
                watched.poll()
            time.sleep(SETTLED_S)
            watched.poll()
            before, logs, bytes_ = used(robots), size_of_logs(folder), watched.monitor.bytes
            time.sleep(REAL_TIME_S)
            watched.poll()
            after, factor = used(robots), DAY_S / REAL_TIME_S / ROBOTS
            cpu, written = (factor * (b - a) for a, b in zip(before, after, strict=True))
            telemetry = factor * (watched.monitor.bytes - bytes_)
            print(
                f"a robot process a day: {cpu / 60:.0f} min of a core ({100 * cpu / DAY_S:.1f} %),"
            )
            print(
                f"  {written / MB:.0f} MB written to the disk (snapshots every 10 s, encounters),"
            )
            log = factor * (size_of_logs(folder) - logs)
            print(f"  {log / MB:.2f} MB of log, {telemetry / MB:.0f} MB of telemetry")
            rss = sum(psutil.Process(robot.pid).memory_info().rss for robot in robots) / ROBOTS
            print(f"  (RSS {rss / 2**20:.0f} MiB)")
    finally:
        stop(robots)
        stop([arena])


def used(robots: Sequence[subprocess.Popen[bytes]]) -> tuple[float, float]:
    """Return the processor time (s) and bytes written of all robots so far."""
    processes = [psutil.Process(robot.pid) for robot in robots]
    return (
        float(sum(sum(process.cpu_times()[:2]) for process in processes)),
        float(sum(process.io_counters().write_bytes for process in processes)),
    )


def size_of_logs(folder: Path) -> int:
    """Return the size of the robots' logs."""
    return sum((folder / f"{number}.log").stat().st_size for number in range(ROBOTS))


def main() -> None:
    minutes = float(sys.argv[1]) if len(sys.argv) > 1 else MINUTES
    with tempfile.TemporaryDirectory() as folder:
        disk(Path(folder), minutes)
        real_time(Path(folder))


if __name__ == "__main__":
    main()
