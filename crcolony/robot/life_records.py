"""What every agent of a robot achieved in its lifetime, recorded at the turnover."""

from crcolony.evolution.history import Lived
from crcolony.robot.robot import Robot
from crcolony.robot.state import Robots


def lifetimes_of(robot: Robot, batch: Robots, tick: int, number: int) -> list[Lived]:
    """Return what every agent of a robot achieved; call it before the turnover. `number` is the
    robot's."""
    row = robot.row
    return [
        Lived(
            tick=tick,
            robot=number,
            generation=robot.generation,
            agent=agent,
            steps=int(batch.steps_alive[row, index]),
            energy=float(batch.energy_sum[row, index]) / max(int(batch.steps_alive[row, index]), 1),
            captures=int(batch.captures[row, index]),
            matings=int(batch.matings[row, index]),
        )
        for index, agent in enumerate(robot.subpopulation.ids)
    ]
