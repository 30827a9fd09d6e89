"""The arena is drawn as it is: y up, everybody in place, matings for a moment, and nothing twice."""

import json

import numpy as np
import pytest
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.tabs.arena import ROOT, ArenaTab, field_rim, fit
from crcolony_dashboards.view_model.colony_view import MATING_S, MEETING_S
from hypothesis import assume, given
from hypothesis import strategies as st

from crcolony.protocol.telemetry_messages import SILENT_AFTER_S
from tests.support.drawn import RecordingStage, Show
from tests.support.fake_telemetry import NATURE, FakeTelemetry, mated, met

ROBOTS = [f"{ROOT}/{what}" for what in ("energy", "robots", "headings", "founders")]


@pytest.fixture
def show() -> Show:
    """Two robots in an arena."""
    show = Show(ArenaTab())
    show.sample.join(0, 1)
    show.sample.scene((0, -0.5, 0.0), (1, 0.5, 0.0))
    return show


def lines(streams: RecordingStage, kind: str) -> list[list[list[float]]]:
    return streams.shown(f"{ROOT}/{kind}", "strips")


class TestFit:
    """The picture reaches from -1 to 1, with y up."""

    @given(
        st.floats(0.01, 1e4), st.floats(0.01, 1e4), st.floats(-1e3, 1e3), st.floats(-1e3, 1e3)
    )  # fmt: skip
    def test_corners_are_at_the_edge(
        self, width_m: float, height_m: float, x_m: float, y_m: float
    ) -> None:
        """The longer side from edge to edge, the shorter as much less, and the middle in the middle."""
        corners = np.array([(x_m, y_m), (x_m + width_m, y_m + height_m)])
        streams = RecordingStage()
        streams.log(ROOT, fit(corners))
        # Rerun keeps a matrix column by column
        matrix = np.array(streams.shown(ROOT, "mat3x3")[0]).reshape(3, 3).T
        shift = np.array(streams.shown(ROOT, "translation")[0])
        low, high = (matrix @ np.array([*corner, 0.0]) + shift for corner in corners)
        longer = max(width_m, height_m)
        precision = 1e-6 * max(1.0, 10.0 * max(abs(x_m), abs(y_m)) / longer)
        # a picture counts from its top: what is low in the arena is far down in it
        assert low[:2] == pytest.approx([-width_m / longer, height_m / longer], abs=precision)
        assert high[:2] == pytest.approx([width_m / longer, -height_m / longer], abs=precision)


class TestFieldRim:
    """What a camera sees ends at its range, or at the wall."""

    @given(
        st.floats(-0.95, 0.95), st.floats(-0.95, 0.95), st.floats(0.5, 4.0), st.floats(0.5, 4.0),
        st.floats(-7.0, 7.0), st.floats(0.05, 5.0),
    )  # fmt: skip
    def test_a_ray_ends_where_it_meets_the_wall(
        self, x: float, y: float, width_m: float, height_m: float, angle: float, range_m: float
    ) -> None:
        """As somebody finds who walks along it in small steps until there is a wall, or the range is at its end."""
        sample = FakeTelemetry()
        sample.scene(width_m=width_m, height_m=height_m)
        sample.pass_s(0.0)
        half_m = 0.5 * np.array([width_m, height_m])
        eye = half_m * (x, y)
        ahead = np.array([np.cos(angle), np.sin(angle)])
        assume(np.abs(ahead).min() > 1e-6)
        steps_m = np.linspace(0.0, range_m, 4001)
        walked = eye + steps_m[:, None] * ahead
        inside = np.all(np.abs(walked) <= half_m, axis=-1)
        walked_m = steps_m[inside.argmin() - 1] if not inside.all() else range_m
        (rim,) = field_rim(eye, np.array([angle]), range_m, sample.view.scenes()[0])
        assert float(np.linalg.norm(rim - eye)) == pytest.approx(walked_m, abs=range_m / 4000)
        assert np.all(np.abs(rim) <= half_m + 1e-9)

    def test_along_an_axis_it_ends_there_too(self) -> None:
        """Where the other coordinate never comes to a wall; and a robot beside the arena sees nothing."""
        sample = FakeTelemetry()
        sample.scene(width_m=2.0, height_m=4.0)
        sample.pass_s(0.0)
        (scene,) = sample.view.scenes()
        angles = np.array([0.0, 0.5, 1.0, 1.5]) * np.pi
        rim = field_rim(np.array([0.5, 0.5]), angles, 9.0, scene)
        assert rim == pytest.approx(np.array([(1.0, 0.5), (0.5, 2.0), (-1.0, 0.5), (0.5, -2.0)]))
        assert field_rim(np.array([1.0, 0.0]), angles[:1], 9.0, scene).tolist() == [[1.0, 0.0]]


class TestRobots:
    """Everybody is drawn where and as they are."""

    def test_robots_are_where_the_arena_says(self, show: Show) -> None:
        """Disc, face and founder in one place, the nose ahead; with their names."""
        show.sample.scene((0, -0.5, 0.25, 0.5 * np.pi), (1, 0.5, 0.0))
        streams = show.draw(0.1)
        for what in ("energy", "robots", "founders"):
            assert streams.shown(f"{ROOT}/{what}", "positions") == [[-0.5, 0.25], [0.5, 0.0]]
        assert streams.shown(f"{ROOT}/robots", "labels") == ["#0", "#1"]
        nose, _ = streams.shown(f"{ROOT}/headings", "positions")
        assert nose == pytest.approx([-0.5, 0.25 + 1.25 * 0.11])
        assert len(streams.colours(f"{ROOT}/energy")) == 2

    def test_a_face_lies_on_its_ring(self, show: Show) -> None:
        """Which is as large as the robot, and is seen around it."""
        streams = show.draw(0.1)
        (ring,), (face,), (founder,) = (
            streams.shown(f"{ROOT}/{what}", "radii") for what in ("energy", "robots", "founders")
        )
        assert ring == founder == pytest.approx(0.11)
        assert 0.5 * ring < face < 0.8 * ring
        (low,), (high,) = (
            streams.shown(f"{ROOT}/{what}", "draw_order") for what in ("energy", "robots")
        )
        assert low < high

    def test_of_many_no_names_are_shown(self, show: Show) -> None:
        """Those of before neither."""
        show.sample.scene(*((k, 0.01 * k, 0.0) for k in range(40)))
        streams = show.draw(0.1)
        assert streams.shown(f"{ROOT}/robots", "show_labels") == [True]
        assert len(streams.shown(f"{ROOT}/robots", "labels")) == 40
        show.sample.scene(*((k, 0.01 * k, 0.0) for k in range(41)))
        streams = show.draw(0.1)
        assert streams.shown(f"{ROOT}/robots", "show_labels") == [False]
        assert len(streams.shown(f"{ROOT}/robots", "positions")) == 41

    def test_packs_are_where_the_arena_says(self, show: Show) -> None:
        """An empty one is dark; in a large arena they are larger."""
        show.sample.scene(packs=[(0.5, 0.5, 0.4), (-0.5, 0.5, 0.0)])
        streams = show.draw(0.1)
        assert streams.shown(f"{ROOT}/packs", "positions") == [[0.5, 0.5], [-0.5, 0.5]]
        assert streams.colours(f"{ROOT}/packs") == [palette.PACK, palette.EMPTY_PACK]
        (small,) = streams.shown(f"{ROOT}/packs", "radii")
        show.sample.scene(packs=[(0.5, 0.5, 0.4)], width_m=100.0)
        (large,) = show.draw(0.1).shown(f"{ROOT}/packs", "radii")
        assert (small, large) == pytest.approx((0.35 * 0.11, 0.35 * 0.55))

    def test_nothing_is_drawn_again_when_nothing_is_new(self, show: Show) -> None:
        """Only the words beside it, once a second, and the moment somebody falls silent."""
        assert set(ROBOTS) <= set(show.draw(0.1).paths())
        for _ in range(20):
            assert set(show.draw(0.05).paths()) <= {"/arena/now"}
        grey = [show.draw(0.1).times(f"{ROOT}/energy") for _ in range(40)]
        assert sum(grey) == 1
        assert show.streams.colours(f"{ROOT}/energy") == [palette.STALE] * 2

    def test_a_new_scene_is_drawn_at_the_next_moment(self, show: Show) -> None:
        """At most ten times a second, however many there are."""
        drawn = 0
        for k in range(100):
            show.sample.scene((0, 0.001 * k, 0.0))
            drawn += show.draw(0.02).times(f"{ROOT}/robots")
        assert drawn == pytest.approx(20, abs=1)

    def test_before_an_arena_is_seen_nobody_is_drawn(self) -> None:
        """And who has gone with the arena is drawn no more."""
        show = Show(ArenaTab())
        streams = show.draw(0.1)
        assert streams.shown(f"{ROOT}/robots", "positions") == []
        show.sample.scene((0, 0.0, 0.0))
        assert len(show.draw(0.1).shown(f"{ROOT}/robots", "positions")) == 1
        show.sample.forget_absent()
        assert show.draw(0.1).shown(f"{ROOT}/robots", "positions") == []


class TestWalls:
    """Arenas have walls, and names if there are several."""

    def test_walls_are_drawn_when_they_change(self, show: Show) -> None:
        """And fitted into the view."""
        streams = show.draw(0.1)
        (wall,) = lines(streams, "walls")
        assert wall == [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]]
        show.sample.scene((0, 0.0, 0.0))
        assert show.draw(0.1).times(f"{ROOT}/walls") == 0
        show.sample.scene((0, 0.0, 0.0), width_m=4.0)
        streams = show.draw(0.1)
        assert (streams.times(f"{ROOT}/walls"), streams.times(ROOT)) == (1, 1)

    def test_several_arenas_are_named(self, show: Show) -> None:
        """One that is left alone is not: nobody's name stands on it."""
        show.sample.scene((2, 0.0, 0.0), arena="attic")
        streams = show.draw(0.1)
        assert len(lines(streams, "walls")) == 2
        assert streams.shown(f"{ROOT}/walls", "labels") == ["attic", "lab"]
        assert streams.shown(f"{ROOT}/walls", "show_labels") == [True]
        show.sample.forget_absent()
        show.sample.scene((0, 0.0, 0.0))
        streams = show.draw(0.1)
        assert len(lines(streams, "walls")) == 1
        assert streams.shown(f"{ROOT}/walls", "labels") == []


class TestTrails:
    """A point is left where everybody was."""

    def test_trails_are_left_unless_the_colony_leaps(self, show: Show) -> None:
        """One that runs so fast has none."""
        streams = show.draw(0.2)
        assert streams.shown(f"{ROOT}/trails", "positions") == [[-0.5, 0.0], [0.5, 0.0]]
        show.sample.scene((0, 0.0, 0.0), tick=1_005)
        assert show.draw(0.2).shown(f"{ROOT}/trails", "positions") == [[0.0, 0.0]]
        show.sample.scene((0, 0.0, 0.0), tick=1_015)
        assert show.draw(0.2).shown(f"{ROOT}/trails", "positions") == []


class TestFields:
    """What a few robots' cameras see."""

    def test_a_field_begins_and_ends_at_the_eye(self, show: Show) -> None:
        """It looks ahead, as far as the arena says that its bodies see."""
        nature = json.loads(NATURE)
        nature["body"] |= {"camera_range_m": 0.25, "camera_half_angle_rad": 0.1}
        show.sample.about_arena(settings=json.dumps(nature))
        strips = lines(show.draw(0.1), "camera_fields")
        assert len(strips) == 2
        for strip, eye in zip(strips, ([-0.5, 0.0], [0.5, 0.0]), strict=True):
            assert strip[0] == strip[-1] == eye
            assert strip[len(strip) // 2] == pytest.approx([eye[0] + 0.25, 0.0])
            assert strip[1][1] == pytest.approx(-0.25 * np.sin(0.1))

    def test_several_arenas_have_fields_of_their_own(self, show: Show) -> None:
        """Beside each other, as the arenas are."""
        show.sample.about_arena()
        show.sample.about_arena("north")
        show.sample.scene((2, 0.0, 0.0), arena="north")
        eyes = [strip[0] for strip in lines(show.draw(0.1), "camera_fields")]
        assert eyes == [[-0.5, 0.0], [0.5, 0.0], [pytest.approx(2.4), 0.0]]

    @pytest.mark.parametrize("settings", [json.dumps({"body": {"camera": False}}), "{}"])
    def test_who_has_no_camera_has_no_field(self, show: Show, settings: str) -> None:
        """Nor has an arena that has not told of its bodies."""
        assert lines(show.draw(0.1), "camera_fields") == []
        show.sample.about_arena(settings=settings)
        show.sample.scene((0, 0.0, 0.0))
        assert lines(show.draw(0.1), "camera_fields") == []

    def test_of_many_no_fields_are_drawn(self, show: Show) -> None:
        """They would hide everything; those of before go."""
        show.sample.about_arena()
        assert len(lines(show.draw(0.1), "camera_fields")) == 2
        show.sample.scene(*((k, 0.1 * k, 0.0) for k in range(9)))
        assert lines(show.draw(0.1), "camera_fields") == []


class TestPairings:
    """Who has just met or mated is joined by a line, for a moment."""

    def test_lines_of_a_mating_appear_and_are_taken_away_again(self, show: Show) -> None:
        """Between where the two are, in the colour of what became of it; without any other news."""
        show.sample.tell(0, mated(0, 1, conceived=True))
        streams = show.draw(0.1)
        assert lines(streams, "matings") == [[[-0.5, 0.0], [0.5, 0.0]]]
        assert streams.colours(f"{ROOT}/matings") == [palette.CONCEIVED]
        assert lines(show.draw(MATING_S - 0.2), "matings") != []
        assert lines(show.draw(0.2), "matings") == []
        assert show.draw(0.2).times(f"{ROOT}/matings") == 0

    def test_a_meeting_is_shown_more_shortly(self, show: Show) -> None:
        """It is no mating, and a mating without offspring has a colour of its own."""
        show.sample.tell(0, met(1), mated(0, 1))
        streams = show.draw(0.1)
        assert (len(lines(streams, "meetings")), len(lines(streams, "matings"))) == (1, 1)
        assert streams.colours(f"{ROOT}/matings") == [palette.MATED]
        streams = show.draw(MEETING_S)
        assert (len(lines(streams, "meetings")), len(lines(streams, "matings"))) == (0, 1)

    def test_lines_follow_robots_that_move(self, show: Show) -> None:
        """And end with one that is not seen any more."""
        show.sample.tell(0, mated(0, 1))
        show.draw(0.1)
        show.sample.scene((0, -0.5, 0.5), (1, 0.5, 0.5))
        assert lines(show.draw(0.1), "matings") == [[[-0.5, 0.5], [0.5, 0.5]]]
        show.sample.scene((0, -0.5, 0.5))
        assert lines(show.draw(0.1), "matings") == []

    def test_who_has_no_body_has_no_line(self, show: Show) -> None:
        """Matings of robots that no arena shows are not drawn."""
        show.sample.tell(7, mated(7, 8))
        assert show.draw(0.1).times(f"{ROOT}/matings") == 0


class TestNow:
    """The colony in words, beside the picture."""

    def test_it_is_said_once_a_second(self, show: Show) -> None:
        """Even if nothing can be seen."""
        said = [show.draw(0.1).times("/arena/now") for _ in range(40)]
        assert sum(said) == pytest.approx(4, abs=1)
        assert "2 robots alive" in show.streams.text("/arena/now")

    def test_silence_is_seen(self, show: Show) -> None:
        """Robots of an arena that says nothing any more are grey, though they speak."""
        show.draw(0.1)
        for _ in range(int(SILENT_AFTER_S) + 1):
            show.sample.state(0, 1)
            show.draw(1.0)
        assert show.streams.colours(f"{ROOT}/energy") == [palette.STALE] * 2
