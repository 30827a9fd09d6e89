"""What a dashboard costs, how large its recordings are, and how late its pictures.

Run with `make bench`, or `python -m tests.benchmarks.bench_dashboard [minutes [robots]]`: with minutes, how its memory
grows. A synthetic colony (`synthetic_colony.py`) publishes what a real one would at ten periods a second; the
dashboard is its only subscriber.
"""

import contextlib
import sqlite3
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np
import psutil

from crcolony.transport.zenoh_session import free_port
from tests.benchmarks.processes import child, commands, here
from tests.support import synthetic_colony
from tests.support.rerun_viewer import decode, headless_viewer

COLONY_SIZES = (4, 100, 1_000)
SETTLED_S, MEASURED_S = 8.0, 20.0
JUMPS, CHANGED = 15, 500
"""Pixels"""
TARGET = 0.20
MIB = 2**20


@contextmanager
def status(
    count: int, folder: Path, walks: bool = True
) -> Iterator[tuple[Connection, psutil.Process, Path, str]]:
    """A colony and its dashboard: the connection to the colony, process and folder of the dashboard, and its URL."""
    with ExitStack() as stack:
        endpoint, port, out = here(), free_port(), folder / f"watched-{count}-{walks}"
        colony = stack.enter_context(child(synthetic_colony.live, count, endpoint, walks))
        assert colony.recv() == "ready"
        line = ["dashboard", "--connect", endpoint, "--port", str(port), "--out", str(out)]
        (process,) = stack.enter_context(commands(folder / f"logs-{count}-{walks}", line))
        wait_for_output(folder / f"logs-{count}-{walks}" / "0.log", "watching", process)
        yield colony, psutil.Process(process.pid), out, f"rerun+http://127.0.0.1:{port}/proxy"


def wait_for_output(log: Path, words: str, process: "subprocess.Popen[bytes]") -> None:
    """Wait until these words are in the output of a process."""
    until_s = time.monotonic() + 30.0
    while words not in log.read_text():
        assert process.poll() is None, log.read_text()
        assert time.monotonic() < until_s, log.read_text()
        time.sleep(0.05)


def cpu_s(process: psutil.Process) -> float:
    """Return the CPU time that a process has used."""
    times = process.cpu_times()
    return float(times.user + times.system)


def sent_by(colony: Connection) -> int:
    """Return how many bytes a synthetic colony has published."""
    colony.send(synthetic_colony.SENT)
    return int(colony.recv())


def recorded(path: Path) -> int:
    """Return the size of a database, with what is not in its file yet."""
    with contextlib.closing(sqlite3.connect(path)) as database:
        (pages,), (page,) = (
            database.execute(f"PRAGMA {what}").fetchone() for what in ("page_count", "page_size")
        )
    return int(pages * page)


def measure(count: int, folder: Path) -> None:
    """Print what a dashboard of so many robots costs."""
    with status(count, folder) as (colony, process, out, _url):
        time.sleep(SETTLED_S)
        sent = sent_by(colony)
        started_s, used_s = time.monotonic(), cpu_s(process)
        rrd, sample = (out / "dashboard.rrd").stat().st_size, recorded(out / "telemetry.sqlite")
        time.sleep(MEASURED_S)
        passed_s = time.monotonic() - started_s
        share = (cpu_s(process) - used_s) / passed_s
        rrd_s = ((out / "dashboard.rrd").stat().st_size - rrd) / passed_s
        published_s = (sent_by(colony) - sent) / passed_s
        recorded_s = (recorded(out / "telemetry.sqlite") - sample) / passed_s
        print(
            f"{count:6,} robots   {share:6.1%} of a core   {process.memory_info().rss / MIB:5.0f} MiB"
            f"   receives {published_s / 1e3:5.0f} kB/s   .rrd {rrd_s / 1e3:6.0f} kB/s = {60 * rrd_s / 1e6:5.1f} MB/min"
            f"   telemetry {60 * recorded_s / 1e6:5.1f} MB/min"
            + (f"   (target {TARGET:.0%})" if count == COLONY_SIZES[-1] else ""),
            flush=True,
        )


def measure_latency(folder: Path) -> None:
    """Print how late a robot that jumps is seen to have jumped, in the viewer's pixels."""
    with (
        status(4, folder, walks=False) as (colony, _, _, url),
        headless_viewer(url, folder / "viewer.log") as viewer,
    ):
        view_id = viewer.view("Arena").view_id
        time.sleep(6.0)
        late_s, picture_s = [], []
        for _ in range(JUMPS):
            before = viewer.picture("Arena")
            colony.send(synthetic_colony.JUMP)
            jumped_s = float(colony.recv())
            while True:
                started_s = time.monotonic()
                now = decode(viewer.client.take_screenshot(view_id))
                ended_s = time.monotonic()
                picture_s.append(ended_s - started_s)
                if np.count_nonzero(np.any(now != before, axis=-1)) > CHANGED:
                    break
            late_s.append(ended_s - jumped_s)
    print(
        f"from a published scene to a picture that shows it, without a GPU:"
        f" {1000 * statistics.median(late_s):.0f} ms (median of {JUMPS}),"
        f" at most {1000 * max(late_s):.0f} ms, of which taking the picture"
        f" {1000 * statistics.median(picture_s):.0f} ms",
        flush=True,
    )


def measure_memory(count: int, minutes: float, folder: Path) -> None:
    """Print how the memory of a dashboard grows."""
    with status(count, folder) as (_, process, _, _url):
        started_s = time.monotonic()
        while (passed_s := time.monotonic() - started_s) < 60.0 * minutes:
            mib = process.memory_info().rss / MIB
            print(f"{count:6,} robots   after {passed_s / 60:4.1f} min {mib:5.0f} MiB", flush=True)
            time.sleep(min(120.0, max(0.1, 60.0 * minutes - passed_s)))
        print(
            f"{count:6,} robots   at the end {process.memory_info().rss / MIB:5.0f} MiB", flush=True
        )


def main() -> None:
    """Print all figures."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if len(sys.argv) > 1:
            measure_memory(
                int(sys.argv[2]) if len(sys.argv) > 2 else 100, float(sys.argv[1]), folder
            )
            return
        for count in COLONY_SIZES:
            measure(count, folder)
        measure_latency(folder)


if __name__ == "__main__":
    main()
