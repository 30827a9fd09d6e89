"""Generations that robots report to a tab of the dashboard."""

import numpy as np

from tests.support.drawn import TabHarness
from tests.support.fake_telemetry import SCHEMA, agent, born, lived

RNG = np.random.default_rng(1)
GENES = [SCHEMA.random(RNG) for _ in range(200)]
"""Of agents"""


def report_generation(
    show: TabHarness, number: int, agents: int = 3, robots: tuple[int, ...] = (0, 1)
) -> None:
    """Report a whole generation and the births of the next; agents of robots with higher numbers mate more."""
    for robot in robots:
        names = [agent(robot, 100 * number + k) for k in range(agents)]
        for k, name in enumerate(names):
            genes = list(GENES[(robot + 2 * k) % len(GENES)])
            show.telemetry.events(robot, born(name, number, genes))
        for k, name in enumerate(names):
            show.telemetry.events(robot, lived(name, number, matings=robot + k, captures=10 * k))
        child = agent(robot, 100 * (number + 1))
        show.telemetry.events(robot, born(child, number + 1, list(GENES[7])))
        show.telemetry.state(robot, generation=number + 1, agent=child)
    show.telemetry.advance_s(0.5)
