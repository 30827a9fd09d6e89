"""A host receives its colony: robots, arenas, clocks; or it is said why it cannot."""

from pathlib import Path

from crcolony_deploy.doctor.colony_view import view_colony

from crcolony.transport.network_settings import NetworkSettings
from tests.support.process_colony import colony


def test_robots_and_arenas_that_are_online_are_seen(tmp_path: Path) -> None:
    """With the clock of the robots' host, which is this one; it ends as soon as they are enough."""
    with colony(tmp_path) as made:
        made.arena(2)
        robot = made.robot()
        robot.wait_for("has body", within_s=120.0)
        view = view_colony(
            NetworkSettings(connect=(made.endpoint,)),
            30.0,
            lambda robots: any(status.state and status.state.arena for status in robots),
        )
        assert [status.robot for status in view.robots] == [robot.id]
        assert [arena.name for arena in view.arenas if arena.is_alive] == ["arena"]
        assert view.is_linked
        assert abs(view.clock_offsets_s[robot.id]) < 2.0
        assert view.other_versions == {}


def test_routers_that_cannot_be_reached_are_the_problem() -> None:
    """Said in a line."""
    network = NetworkSettings(role="client", connect=("tcp/127.0.0.1:1",))
    view = view_colony(network, 1.0, lambda robots: False)
    assert "no router answers at tcp/127.0.0.1:1" in view.problem
