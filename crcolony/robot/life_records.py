"""What every agent of a robot achieved in its lifetime, recorded at the turnover."""

from crcolony.evolution.history import Lived
from crcolony.robot.robot import Robot
from crcolony.robot.state import Robots


def lifetimes_of(robot: Robot, batch: Robots, tick: int, number: int) -> list[Lived]:
    """Return what every agent of a robot has made of its life, before the turnover."""
    row = robot.row
    return [
        Lived(
            tick=tick,
            robot=number,
            generation=robot.generation,
            agent=agent,
            steps=int(batch.steps_alive[row, place]),
            energy=float(batch.energy_sum[row, place]) / max(int(batch.steps_alive[row, place]), 1),
            captures=int(batch.captures[row, place]),
            matings=int(batch.matings[row, place]),
        )
        for place, agent in enumerate(robot.subpopulation.ids)
    ]
