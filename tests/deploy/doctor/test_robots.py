"""The robots of a host are online with bodies, or it is said which is not, and why that may be."""

from pathlib import Path

from crcolony_deploy.doctor.colony_view import ColonyView
from crcolony_deploy.doctor.robots import check_robots

from crcolony.telemetry.robot_status import RobotStatus
from crcolony.transport.network_settings import NetworkSettings
from tests.support.deployment import Deployment
from tests.support.examined_hosts import ADA, BOB, host_of, lines, online, service

OPTIONS = "--colony reef --arena pond"


def examine(folder: Path, colony: ColonyView, own: dict[str, bytes]) -> list[str]:
    """Return what is found on a host with one robot, ada."""
    return lines(
        check_robots(host_of(folder, service("robot", "ada", OPTIONS), colony=colony, own=own))
    )


def test_a_robot_with_a_body_is_well(tmp_path: Path) -> None:
    """It lives in its arena."""
    found = examine(tmp_path, ColonyView((online(ADA, "pond"),)), {"ada": ADA})
    assert found == ["ok: robot ada lives in arena pond"]


def test_a_robot_that_is_not_online_is_a_problem(tmp_path: Path) -> None:
    """Whatever systemd thinks of its process."""
    found = examine(tmp_path, ColonyView((online(BOB, "pond"),)), {"ada": ADA})
    assert found == [f"problem: robot ada ({ADA.hex()[:8]}) is not online"]


def test_a_robot_without_a_body_is_a_problem(tmp_path: Path) -> None:
    """Its arena is off, or full."""
    found = examine(tmp_path, ColonyView((online(ADA, ""),)), {"ada": ADA})
    assert found == ["problem: robot ada has no body"]


def test_a_key_that_cannot_be_read_is_a_problem(tmp_path: Path) -> None:
    """Nobody knows then who is to be online."""
    assert examine(tmp_path, ColonyView(), {}) == ["problem: robot ada: its key cannot be read"]


def test_a_colony_that_cannot_be_reached_is_one_problem(tmp_path: Path) -> None:
    """Not one for each robot."""
    found = examine(tmp_path, ColonyView(problem="no router answers"), {"ada": ADA})
    assert found == ["problem: the colony cannot be reached: no router answers"]


def test_another_colony_of_the_same_name_is_noticed(tmp_path: Path) -> None:
    """Its robots live in an arena of which no service of this host knows."""
    view = ColonyView((online(ADA, "pond"), online(BOB, "lake"), online(b"c" * 16, "sea", "other")))
    found = examine(tmp_path, view, {"ada": ADA})
    assert found[1:] == [
        "warning: robots of this host's colony live in arenas that it does not know: lake"
    ]


def test_a_robot_s_credentials_see_who_is_online_alone(tmp_path: Path) -> None:
    """States are sent to observers: that none arrives is no problem of the robot's body."""
    deployment = Deployment(tmp_path / "deployment")
    _, ada = deployment.robot("ada")
    wall = deployment.member("observer", "wall")
    robot = service("robot", "ada", f"{OPTIONS} --credentials {ada}")
    view = ColonyView((RobotStatus(ADA, "reef"),))
    for credentials, expected in (
        (ada, "ok: robot ada is online; with an observer's credentials more is seen"),
        (wall, "problem: robot ada has no body"),
    ):
        network = NetworkSettings(credentials=credentials)
        host = host_of(tmp_path, robot, colony=view, own={"ada": ADA}, network=network)
        assert lines(check_robots(host)) == [expected]
