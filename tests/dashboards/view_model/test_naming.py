"""Names of robots are short, and no two are equal."""

import pytest
from crcolony_dashboards.view_model.naming import agent_number, agent_robot
from hypothesis import given
from hypothesis import strategies as st

from tests.support.fake_telemetry import IDS, FakeTelemetry, agent


@pytest.fixture
def sample() -> FakeTelemetry:
    return FakeTelemetry()


class TestNames:
    """How robots are called: shortly, and no two alike."""

    def test_a_robot_is_called_by_its_number(self, sample: FakeTelemetry) -> None:
        """Once it has said it; before that by its id."""
        sample.come(0)
        sample.pass_s(0.5)
        assert sample.view.name_of(IDS[0]) == IDS[0].hex()[:8]
        sample.join(0, number=12)
        assert sample.view.name_of(IDS[0]) == "#12"
        assert sample.view.name_of(IDS[9]) == IDS[9].hex()[:8]

    def test_two_robots_with_one_number_are_called_by_their_ids(
        self, sample: FakeTelemetry
    ) -> None:
        """A third is not touched by that."""
        sample.join(0, 1, number=0)
        sample.join(2, number=7)
        names = [sample.view.name_of(robot) for robot in IDS[:3]]
        assert names == [IDS[0].hex()[:8], IDS[1].hex()[:8], "#7"]

    def test_of_several_colonies_the_colony_is_said(self, sample: FakeTelemetry) -> None:
        """Numbers may repeat then."""
        sample.join(0, number=0)
        sample.join(1, number=0, colony="red")
        sample.pass_s(0.5)
        assert [sample.view.name_of(robot) for robot in IDS[:2]] == ["blue #0", "red #0"]

    @given(
        st.lists(
            st.tuples(st.sampled_from(["blue", "red"]), st.none() | st.integers(0, 3)), max_size=12
        )
    )
    def test_no_two_are_called_alike(self, robots: list[tuple[str, int | None]]) -> None:
        """Whatever numbers they say they have, in however many colonies."""
        sample = FakeTelemetry()
        for robot, (colony, number) in enumerate(robots):
            sample.come(robot, colony=colony)
            if number is not None:
                sample.state(robot, colony=colony, number=number)
        sample.pass_s(0.5)
        sample.pass_s(0.5)
        names = [sample.view.name_of(robot) for robot in IDS[: len(robots)]]
        assert len(set(names)) == len(names)


def test_an_agents_name_tells_its_number_and_its_robot() -> None:
    """A name that tells no robot is nobody's."""
    assert agent_number(agent(3, 17)) == "17"
    assert agent_robot(agent(3, 17)) == IDS[3]
    assert (agent_number("x"), agent_robot("x")) == ("x", b"")
