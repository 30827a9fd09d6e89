"""How long a user waits: for `--help`, and for the first generation of a run whose code is compiled already.

Run with `make bench`, or `python -m tests.benchmarks.bench_start`. Whole processes, from start to the line read: the
time of a clock, and that of the processor, which other processes do not change.
"""

import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import psutil

REPEATS = 5


def seconds_until(word: str, *words: str) -> tuple[float, float]:
    """Return the time, and the processor's time, from starting a command to its first line with `word` in it."""
    start = time.perf_counter()
    command = [sys.executable, "-m", "crcolony", *words]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            if word in line:
                took = time.perf_counter() - start
                busy = sum(psutil.Process(process.pid).cpu_times()[:2])
                process.communicate()
                return took, busy
    raise AssertionError(f"{words} never said {word}")


def main() -> None:
    helps = [seconds_until("usage", "--help")[0] for _ in range(REPEATS)]
    with tempfile.TemporaryDirectory() as folder:
        starts = [
            seconds_until(
                "generation 1:", "evolve", "--generations", "1", "--out", str(Path(folder) / str(k))
            )
            for k in range(REPEATS + 1)
        ][1:]  # the first may compile
    took, busy = (statistics.median(figures) for figures in zip(*starts, strict=True))
    print(f"--help: {statistics.median(helps):.2f} s  (target 0.3)")
    print(
        f"second start of evolve: {took:.2f} s, {busy:.2f} s of CPU, to the end of the first"
        " generation, of 96,000 robot-steps  (target 1.5 s of CPU)"
    )


if __name__ == "__main__":
    main()
