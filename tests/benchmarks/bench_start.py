"""How long a user waits: for `--help`, and for the first generation of a run whose code is compiled already.

Run with `make bench`, or `python -m tests.benchmarks.bench_start`. Whole processes, from start to the line read.
"""

import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

REPEATS = 5


def seconds_until(word: str, *words: str) -> float:
    """Return the time from starting a command to its first line with `word` in it."""
    start = time.perf_counter()
    command = [sys.executable, "-m", "crcolony", *words]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            if word in line:
                took = time.perf_counter() - start
                process.communicate()
                return took
    raise AssertionError(f"{words} never said {word}")


def main() -> None:
    helps = [seconds_until("usage", "--help") for _ in range(REPEATS)]
    with tempfile.TemporaryDirectory() as folder:
        starts = [
            seconds_until(
                "generation 1:", "evolve", "--generations", "1", "--out", str(Path(folder) / str(k))
            )
            for k in range(REPEATS + 1)
        ][1:]  # the first may compile
    print(f"--help: {statistics.median(helps):.2f} s  (target 0.3)")
    print(
        f"second start of evolve: {statistics.median(starts):.2f} s to the end of the first"
        " generation, of 96,000 robot-steps  (target 3 to the first step)"
    )


if __name__ == "__main__":
    main()
