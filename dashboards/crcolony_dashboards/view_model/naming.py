"""How robots and agents are named in the dashboard."""

from collections import Counter
from collections.abc import Callable, Mapping

from crcolony.protocol.identity import RobotId
from crcolony.telemetry.robot_status import RobotStatus

NameLookup = Callable[[RobotId], str]
"""Returns the displayed name of a robot"""


def short_id(robot: RobotId) -> str:
    """Return the first eight hexadecimal digits of a robot's id."""
    return robot.hex()[:8]


def robot_names(
    robots: Mapping[RobotId, RobotStatus], has_several_colonies: bool
) -> dict[RobotId, str]:
    """Return the displayed name of every robot; no two are equal.

    A robot is named by its number if no other robot of its colony has the same number, else by its short id. The
    colony's name precedes it if there are several colonies.
    """
    counts = Counter(
        (status.colony, status.state.number) for status in robots.values() if status.state
    )
    names = {}
    for robot, status in robots.items():
        number = status.state.number if status.state is not None else None
        is_unique = number is not None and counts[status.colony, number] == 1
        name = f"#{number}" if is_unique else short_id(robot)
        names[robot] = f"{status.colony} {name}" if has_several_colonies else name
    return names


def agent_number(agent: str) -> str:
    """Return an agent's number in its robot, the part of its name after the slash."""
    return agent.rpartition("/")[2]


def agent_robot(agent: str) -> RobotId:
    """Return the id of the robot that an agent was born in; empty if the agent's name has none."""
    try:
        return bytes.fromhex(agent.partition("/")[0])
    except ValueError:
        return b""
