"""Camera fields end at their range or the wall, and meetings and matings are lines that are removed again."""

import json

import numpy as np
import pytest
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.tabs.arena_layout import ROOT
from crcolony_dashboards.tabs.arena_lines import field_rim
from crcolony_dashboards.tabs.colony import ColonyTab
from crcolony_dashboards.view_model.pairings import MATING_S, MEETING_S
from hypothesis import assume, given
from hypothesis import strategies as st

from tests.support.drawn import RecordingStreams, TabHarness
from tests.support.fake_telemetry import NATURE, FakeTelemetry, mated, met


@pytest.fixture
def show() -> TabHarness:
    """Two robots in an arena."""
    show = TabHarness(ColonyTab())
    show.telemetry.join(0, 1)
    show.telemetry.scene((0, -0.5, 0.0), (1, 0.5, 0.0))
    return show


def lines(streams: RecordingStreams, kind: str) -> list[list[list[float]]]:
    return streams.shown(f"{ROOT}/{kind}", "strips")


class TestFieldRim:
    """A field of view ends at the camera's range or at the wall."""

    @given(
        st.floats(-0.95, 0.95), st.floats(-0.95, 0.95), st.floats(0.5, 4.0), st.floats(0.5, 4.0),
        st.floats(-7.0, 7.0), st.floats(0.05, 5.0),
    )  # fmt: skip
    def test_a_ray_ends_where_it_meets_the_wall(
        self, x: float, y: float, width_m: float, height_m: float, angle: float, range_m: float
    ) -> None:
        """It ends where small steps along it find the wall or the end of the range."""
        telemetry = FakeTelemetry()
        telemetry.scene(width_m=width_m, height_m=height_m)
        telemetry.advance_s(0.0)
        half_m = 0.5 * np.array([width_m, height_m])
        eye = half_m * (x, y)
        ahead = np.array([np.cos(angle), np.sin(angle)])
        assume(np.abs(ahead).min() > 1e-6)
        steps_m = np.linspace(0.0, range_m, 4001)
        walked = eye + steps_m[:, None] * ahead
        inside = np.all(np.abs(walked) <= half_m, axis=-1)
        walked_m = steps_m[inside.argmin() - 1] if not inside.all() else range_m
        (rim,) = field_rim(eye, np.array([angle]), range_m, telemetry.view.scenes()[0])
        assert float(np.linalg.norm(rim - eye)) == pytest.approx(walked_m, abs=range_m / 4000)
        assert np.all(np.abs(rim) <= half_m + 1e-9)

    def test_a_ray_along_an_axis_ends_at_the_wall_too(self) -> None:
        """From a robot at the wall that faces it the field is empty."""
        telemetry = FakeTelemetry()
        telemetry.scene(width_m=2.0, height_m=4.0)
        telemetry.advance_s(0.0)
        (scene,) = telemetry.view.scenes()
        angles = np.array([0.0, 0.5, 1.0, 1.5]) * np.pi
        rim = field_rim(np.array([0.5, 0.5]), angles, 9.0, scene)
        assert rim == pytest.approx(np.array([(1.0, 0.5), (0.5, 2.0), (-1.0, 0.5), (0.5, -2.0)]))
        assert field_rim(np.array([1.0, 0.0]), angles[:1], 9.0, scene).tolist() == [[1.0, 0.0]]


class TestCameraFields:
    """The camera fields of a few robots."""

    def test_a_field_starts_and_ends_at_the_robot(self, show: TabHarness) -> None:
        """It points ahead, with the range and angle that the arena has published."""
        nature = json.loads(NATURE)
        nature["body"] |= {"camera_range_m": 0.25, "camera_half_angle_rad": 0.1}
        show.telemetry.arena_metadata(settings=json.dumps(nature))
        strips = lines(show.draw(0.1), "camera_fields")
        assert len(strips) == 2
        for strip, eye in zip(strips, ([-0.5, 0.0], [0.5, 0.0]), strict=True):
            assert strip[0] == strip[-1] == eye
            assert strip[len(strip) // 2] == pytest.approx([eye[0] + 0.25, 0.0])
            assert strip[1][1] == pytest.approx(-0.25 * np.sin(0.1))

    def test_the_fields_of_several_arenas_are_side_by_side(self, show: TabHarness) -> None:
        """As the arenas are."""
        show.telemetry.arena_metadata()
        show.telemetry.arena_metadata("north")
        show.telemetry.scene((2, 0.0, 0.0), arena="north")
        eyes = [strip[0] for strip in lines(show.draw(0.1), "camera_fields")]
        assert eyes == [[-0.5, 0.0], [0.5, 0.0], [pytest.approx(2.4), 0.0]]

    @pytest.mark.parametrize("settings", [json.dumps({"body": {"camera": False}}), "{}"])
    def test_without_a_camera_there_is_no_field(self, show: TabHarness, settings: str) -> None:
        """Nor in an arena that has not published its settings."""
        assert lines(show.draw(0.1), "camera_fields") == []
        show.telemetry.arena_metadata(settings=settings)
        show.telemetry.scene((0, 0.0, 0.0))
        assert lines(show.draw(0.1), "camera_fields") == []

    def test_fields_of_many_robots_are_not_drawn(self, show: TabHarness) -> None:
        """Those drawn before are removed."""
        show.telemetry.arena_metadata()
        assert len(lines(show.draw(0.1), "camera_fields")) == 2
        show.telemetry.scene(*((k, 0.1 * k, 0.0) for k in range(9)))
        assert lines(show.draw(0.1), "camera_fields") == []


class TestPairings:
    """A line joins two robots that have just met or mated, for a moment."""

    def test_the_line_of_a_mating_appears_and_is_removed(self, show: TabHarness) -> None:
        """It joins the two robots in the colour of the outcome, and is removed without any further telemetry."""
        show.telemetry.events(0, mated(0, 1, conceived=True))
        streams = show.draw(0.1)
        assert lines(streams, "matings") == [[[-0.5, 0.0], [0.5, 0.0]]]
        assert streams.colours(f"{ROOT}/matings") == [palette.CONCEIVED]
        assert lines(show.draw(MATING_S - 0.2), "matings") != []
        assert lines(show.draw(0.2), "matings") == []
        assert show.draw(0.2).times(f"{ROOT}/matings") == 0

    def test_a_meeting_is_shown_for_a_shorter_time(self, show: TabHarness) -> None:
        """It is drawn apart from the mating; a mating without offspring has its own colour."""
        show.telemetry.events(0, met(1), mated(0, 1))
        streams = show.draw(0.1)
        assert (len(lines(streams, "meetings")), len(lines(streams, "matings"))) == (1, 1)
        assert streams.colours(f"{ROOT}/matings") == [palette.MATED]
        streams = show.draw(MEETING_S)
        assert (len(lines(streams, "meetings")), len(lines(streams, "matings"))) == (0, 1)

    def test_lines_follow_robots_that_move(self, show: TabHarness) -> None:
        """They are removed with a robot that is no longer in the scene."""
        show.telemetry.events(0, mated(0, 1))
        show.draw(0.1)
        show.telemetry.scene((0, -0.5, 0.5), (1, 0.5, 0.5))
        assert lines(show.draw(0.1), "matings") == [[[-0.5, 0.5], [0.5, 0.5]]]
        show.telemetry.scene((0, -0.5, 0.5))
        assert lines(show.draw(0.1), "matings") == []

    def test_robots_without_a_body_have_no_lines(self, show: TabHarness) -> None:
        """Matings of robots that are in no scene are not drawn."""
        show.telemetry.events(7, mated(7, 8))
        assert show.draw(0.1).times(f"{ROOT}/matings") == 0
