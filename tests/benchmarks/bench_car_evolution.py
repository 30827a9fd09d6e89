"""A whole evolutionary run on the mountain car beside a loop that was inlined by hand: steps a second, and their ratio.

Run with `python -m tests.benchmarks.bench_car_evolution FOLDER`. The folder holds `rl_lazy.py` (the car and greedy
Sarsa(lambda) with lazy traces, without potential and softmax), which is not part of the project. The evolutionary run
is all there is of it: lives with potential and softmax, selection and variation, but not the measurements afterwards.
Both run in turn in this process; printed are medians of the processor's time.
"""

import os
import sys

import numpy as np

from crcolony.experiments.worlds.mountain_car_evolution import CarEvolution, CarSettings
from crcolony.experiments.worlds.mountain_car_lives import new_driver
from crcolony.randomness import new_streams
from tests.benchmarks.bench_limits import Way, limit_car, medians, product_car, show

SETTINGS = CarSettings(individuals=20, generations=60, episodes=20)
"""A small run, in which the bad learners of the first generations have a larger share"""


def evolution(shaping: bool) -> Way:
    """Return a way to evolve."""
    driver = new_driver()

    def run() -> int:
        stream, rng = new_streams(1, (1,), 1)[0], np.random.default_rng(1)
        cars = CarEvolution(SETTINGS, shaping, driver, rng, stream)
        return sum(int(cars.advance().steps.sum()) for _ in range(SETTINGS.generations))

    return run


def main() -> None:
    """Print speeds, and their ratios to the limit if there is one."""
    folder = sys.argv[1] if len(sys.argv) > 1 else None
    ways = {
        "one learner without potential": product_car,
        "evolution of both": evolution(True),
        "evolution of meta-parameters alone": evolution(False),
    }
    if folder:
        sys.path.insert(0, folder)
        os.chdir(folder)
        ways["limit"] = limit_car
    show("mountain car", medians(ways))


if __name__ == "__main__":
    main()
