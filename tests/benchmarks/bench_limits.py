"""The step beside programs that do less, by hand: what is left to gain, as ratios of the same run.

Run with `python -m tests.benchmarks.bench_limits FOLDER`. The folder holds `sim_numba3.py` (a colony step, inlined by
hand: camera, eight rays, Sarsa(lambda) with 32-bit weights; no occlusion, potentials, softmax or modules) and
`rl_lazy.py` (mountain car with lazy traces), which are not part of the project. Without a folder only the product is
measured. Both run in turn in this process; printed are medians of the processor's time.
"""

import os
import resource
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tests.benchmarks import bench_mountain_car
from tests.benchmarks.bench_colony import colony_step, new_colony

REPEATS = 9
ROBOT_STEPS = 100_000
EVERY_SENSE = ("body.infrared=true", "body.inertial=true", "body.microphones=true")
CAR_STEPS = 500_000

Way = Callable[[], int]
"""Does some steps, and returns how many"""


def medians(ways: dict[str, Way]) -> dict[str, float]:
    """Return millions of steps a second of every way, which take turns."""
    rates: dict[str, list[float]] = {name: [] for name in ways}
    for repeat in range(REPEATS + 1):
        for name, way in ways.items():
            begun = time.process_time()
            steps = way()
            if repeat > 0:  # the first may compile
                rates[name].append(1e-6 * steps / (time.process_time() - begun))
    return {name: statistics.median(found) for name, found in rates.items()}


def product_step(robots: int, *settings: str) -> Way:
    """Return the bare step of a colony that has lived for a while."""
    ticks = max(1, ROBOT_STEPS // robots)
    step = colony_step(new_colony(robots, *settings), ticks)

    def run() -> int:
        step()
        return ticks * robots

    return run


def limit_step(robots: int) -> Way:
    """Return the colony step of the limit."""
    import sim_numba3  # type: ignore[import-not-found]

    world, learners = sim_numba3.make(robots), sim_numba3.learners(robots)
    ticks = max(1, ROBOT_STEPS // robots)

    def run() -> int:
        sim_numba3.full(ticks, world, *learners)
        return ticks * robots

    return run


def limit_car() -> int:
    """Run the mountain car of the limit."""
    import rl_lazy  # type: ignore[import-not-found]

    rl_lazy.loop_lazy(CAR_STEPS, 1, np.zeros(rl_lazy.TOT), np.zeros(300, np.int64))
    return CAR_STEPS


def product_car() -> int:
    """Run the mountain car of the product in its compiled loop."""
    return bench_mountain_car.compiled_loop(np.random.default_rng(1))


def show(what: str, rates: dict[str, float]) -> None:
    """Print rates, and their ratios to the limit if there is one."""
    limit = rates.get("limit")
    shown = [
        f"{name} {rate:.2f}" + (f" ({rate / limit:.2f})" if limit else "")
        for name, rate in rates.items()
    ]
    print(f"{what}: {', '.join(shown)} million steps/s", flush=True)


def kib_of_a_robot(robots: int = 200) -> float:
    """Return the memory that a robot of a colony takes at the end of a generation (KiB)."""
    new_colony(2).run(1)  # compiled code takes memory, too
    before = resident_kib()
    colony = new_colony(robots)
    colony.batch.slice_steps_left[:] = colony.config.life.slice_steps
    while colony.generation == 0:
        colony.run(100_000)
    return (resident_kib() - before) / robots


def resident_kib() -> float:
    """Return the resident memory of this process (KiB)."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 1024


def main() -> None:
    """Print all ratios."""
    folder = sys.argv[1] if len(sys.argv) > 1 else None
    if folder:
        sys.path.insert(0, folder)
        os.chdir(folder)
    print(f"a robot of 200 in-process takes {kib_of_a_robot():.0f} KiB")
    for robots in (4, 100, 1000):
        ways = {"product": product_step(robots), "every sense": product_step(robots, *EVERY_SENSE)}
        show(f"{robots} robots", medians(ways | ({"limit": limit_step(robots)} if folder else {})))
    few, many = product_step(100), product_step(1000)
    rates = medians({"100": few, "1000": many})
    print(f"a robot-step of 1,000 robots costs {rates['100'] / rates['1000']:.2f} times one of 100")
    show(
        "mountain car", medians({"product": product_car} | ({"limit": limit_car} if folder else {}))
    )


if __name__ == "__main__":
    main()
