"""Names of robots are short, and no two are equal."""

import pytest
from crcolony_dashboards.view_model.naming import agent_number, agent_robot
from hypothesis import given
from hypothesis import strategies as st

from tests.support.fake_telemetry import IDS, FakeTelemetry, agent


@pytest.fixture
def telemetry() -> FakeTelemetry:
    return FakeTelemetry()


class TestNames:
    """A robot's name is its number, or a part of its id."""

    def test_a_robot_is_named_by_its_number(self, telemetry: FakeTelemetry) -> None:
        """Before its number is known, by its id."""
        telemetry.online(0)
        telemetry.advance_s(0.5)
        assert telemetry.view.name_of(IDS[0]) == IDS[0].hex()[:8]
        telemetry.join(0, number=12)
        assert telemetry.view.name_of(IDS[0]) == "#12"
        assert telemetry.view.name_of(IDS[9]) == IDS[9].hex()[:8]

    def test_two_robots_with_the_same_number_are_named_by_their_ids(
        self, telemetry: FakeTelemetry
    ) -> None:
        """Others are not affected."""
        telemetry.join(0, 1, number=0)
        telemetry.join(2, number=7)
        names = [telemetry.view.name_of(robot) for robot in IDS[:3]]
        assert names == [IDS[0].hex()[:8], IDS[1].hex()[:8], "#7"]

    def test_with_several_colonies_names_have_the_colony(self, telemetry: FakeTelemetry) -> None:
        """Numbers may repeat then."""
        telemetry.join(0, number=0)
        telemetry.join(1, number=0, colony="red")
        telemetry.advance_s(0.5)
        assert [telemetry.view.name_of(robot) for robot in IDS[:2]] == ["blue #0", "red #0"]

    @given(
        st.lists(
            st.tuples(st.sampled_from(["blue", "red"]), st.none() | st.integers(0, 3)), max_size=12
        )
    )
    def test_no_two_robots_have_the_same_name(self, robots: list[tuple[str, int | None]]) -> None:
        """Whatever numbers they publish, in however many colonies."""
        telemetry = FakeTelemetry()
        for robot, (colony, number) in enumerate(robots):
            telemetry.online(robot, colony=colony)
            if number is not None:
                telemetry.state(robot, colony=colony, number=number)
        telemetry.advance_s(0.5)
        telemetry.advance_s(0.5)
        names = [telemetry.view.name_of(robot) for robot in IDS[: len(robots)]]
        assert len(set(names)) == len(names)


def test_an_agents_name_has_its_number_and_its_robot() -> None:
    """A name without a robot has an empty one."""
    assert agent_number(agent(3, 17)) == "17"
    assert agent_robot(agent(3, 17)) == IDS[3]
    assert (agent_number("x"), agent_robot("x")) == ("x", b"")
