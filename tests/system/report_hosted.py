"""A host of many robots for a long time: what it takes of memory and disk, and whether that grows.

Run with `python -m tests.system.report_hosted --minutes 120` (Linux). Printed twice a minute, and at the end with the
slopes of the whole time and of its second half, each with the 95 % interval of a straight line:

    private_mib   what the process has written to memory, and shares with no other
    unshared_mib  this, and what no other process has read of libraries; the system forgets that when it must
    disk_mib      all files of the arena and the robots
    log_mib       the robots' write-ahead logs among them

A generation of the default world takes 24,000 ticks, 40 minutes at 10 Hz, and until the first is over memory and
snapshots of what the agents learn grow. `--hz 60` shows more generations; robots are saved by the wall clock all the
same.
"""

import argparse
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path

import psutil

from crcolony.transport.zenoh_session import free_port
from tests.support.process import Process
from tests.system.report_soak import slope_per_hour

SAMPLE_S = 30.0
MIB = 2**20


def sample(process: Process, folder: Path) -> dict[str, float]:
    """Return what the host takes now, by name."""
    maps = psutil.Process(process.pid).memory_maps()
    files = [path for path in folder.rglob("*") if path.is_file()]
    sizes = {path: path.stat().st_size for path in files if path.exists()}
    return {
        "private_mib": sum(one.private_dirty for one in maps) / MIB,
        "unshared_mib": sum(one.private_dirty + one.private_clean for one in maps) / MIB,
        "disk_mib": sum(sizes.values()) / MIB,
        "log_mib": sum(size for path, size in sizes.items() if path.name.endswith("-wal")) / MIB,
    }


def report(at_s: list[float], values: dict[str, list[float]]) -> None:
    """Print the first, greatest and last values, and the slopes."""
    print(
        f"{'what':<13} {'first':>8} {'most':>8} {'last':>8}   slope an hour (95 %), of the second half"
    )
    for what, own in values.items():
        ends = f"{own[0]:8.1f} {max(own):8.1f} {own[-1]:8.1f}"
        slopes = (slope_per_hour(at_s, own, after) for after in (0.0, 0.5))
        print(f"{what:<13} {ends}   " + "   ".join(f"{m:+.2f} ± {half:.2f}" for m, half in slopes))


def run(robots: int, hz: float, minutes: float) -> None:
    """Run a host, and print what it took."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "host"
        command = [sys.executable, "-m", "crcolony", "host", "-n", f"{robots}", "--hz", f"{hz:g}"]
        command += ["--out", str(folder), "--listen", f"tcp/127.0.0.1:{free_port()}", "--no-plots"]
        host = Process(command, Path(name) / "log").start()
        try:
            host.wait_for("matings")
            started_s = time.monotonic()
            at_s, values = list[float](), defaultdict[str, list[float]](list)
            while (now_s := time.monotonic() - started_s) < 60.0 * minutes:
                at_s.append(now_s)
                for what, value in sample(host, folder).items():
                    values[what].append(value)
                shown = ", ".join(f"{what} {own[-1]:.1f}" for what, own in values.items())
                print(f"{now_s / 60.0:6.1f} min  {shown}", flush=True)
                time.sleep(SAMPLE_S)
                assert host.is_running, host.output[-2000:]
            print("tick " + host.output.rpartition("tick ")[2].splitlines()[0])
            report(at_s, values)
        finally:
            host.stop()


def main() -> None:
    """Run a host for as long as asked."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--minutes", type=float, default=120.0)
    parser.add_argument("--robots", type=int, default=100)
    parser.add_argument("--hz", type=float, default=10.0)
    options = parser.parse_args()
    run(options.robots, options.hz, options.minutes)


if __name__ == "__main__":
    main()
