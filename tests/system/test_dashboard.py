"""What a person sees in the dashboard is what the colony is: real processes, Rerun's own viewer, and its pixels."""

import contextlib
import signal
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from crcolony_dashboards.tabs import palette

from crcolony.protocol.telemetry_messages import Scene, SceneRobot
from crcolony.transport.zenoh_session import NetworkSettings, open_session
from tests.support.process import Process, wait_until
from tests.support.process_colony import Colony, colony
from tests.support.rerun_viewer import HeadlessViewer, Picture, headless_viewer
from tests.support.telemetry_recorder import BODY_M, TelemetryRecorder, room_m

ROBOTS = 4
HUNGRY = ("life.initial_energy=0.6", "life.energy_per_step=0.004", "arena.packs=2")

TABS = ("Arena", "Life", "Evolution", "Lineage", "NetworkSettings", "Log")
ROOM_M = 0.2
LATE_S = 0.35
"""A picture of a moment may show a scene that came so long before it: one period, one tick of drawing, and the noise"""


@dataclass
class Watched:
    """A colony of processes, its dashboard, a viewer of it, and a witness."""

    made: Colony
    dashboard: Process
    url: str
    viewer: HeadlessViewer
    checker: TelemetryRecorder

    def settle(self, until_s: float) -> None:
        """Wait until the viewer has all that was drawn up to a time."""
        wait_until(
            lambda: self.viewer.until_s("wall") > until_s + 0.3, "the viewer has come so far"
        )


@contextlib.contextmanager
def status(folder: Path) -> Iterator[Watched]:
    """Everything that is needed to see a colony, for as long as it is needed."""
    with contextlib.ExitStack() as stack:
        made = stack.enter_context(colony(folder, *HUNGRY))
        made.arena(ROBOTS, "--hz", "10")
        dashboard, url, _ = made.dashboard()
        for number in range(ROBOTS):
            made.robot("--number", str(number))
        session = stack.enter_context(open_session(NetworkSettings(connect=(made.endpoint,))))
        checker = TelemetryRecorder(session)
        viewer = stack.enter_context(headless_viewer(url, folder / "viewer.log"))
        wait_until(lambda: len(checker.matings) >= 6, "the colony lives, and mates")
        yield Watched(made, dashboard, url, viewer, checker)


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Watched]:
    """A colony that several tests look at."""
    with status(tmp_path_factory.mktemp("seen")) as everything:
        yield everything


class Pixels:
    """Where metres of an arena are in a picture, told by its walls."""

    def __init__(self, picture: Picture, scene: Scene) -> None:
        is_wall = np.all(np.abs(picture.astype(int) - palette.DIM) < 14, axis=-1)
        columns = np.flatnonzero(is_wall.sum(axis=0) > 0.5 * is_wall.sum(axis=0).max())
        rows = np.flatnonzero(is_wall.sum(axis=1) > 0.5 * is_wall.sum(axis=1).max())
        self.picture, self._scene = picture, scene
        self._left, self._right = float(columns.min()), float(columns.max())
        self._top, self._bottom = float(rows.min()), float(rows.max())
        self.per_m = (self._right - self._left - WALL_PX) / scene.width_m

    def of(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Return the column and the row of a place."""
        middle = (0.5 * (self._left + self._right), 0.5 * (self._top + self._bottom))
        return middle[0] + self.per_m * x_m, middle[1] - self.per_m * y_m

    def disc(self, robot: SceneRobot) -> tuple[float, float] | None:
        """Return the middle of the disc that is drawn where a robot should be, by its edges; None if there is none."""
        column, row = self.of(robot.x_m, robot.y_m)
        rows, columns = np.indices(self.picture.shape[:2])
        is_near = np.hypot(rows - row, columns - column) < (ROOM_M - 0.01) * self.per_m
        is_disc = is_near & (np.ptp(self.picture.astype(int), axis=-1) > 50)
        least = 0.25 * BODY_M * self.per_m  # more than what is thin: the line of a mating
        high = np.flatnonzero(is_disc.sum(axis=1) > least)
        wide = np.flatnonzero(is_disc.sum(axis=0) > least)
        if not len(high) or not len(wide):
            return None
        return 0.5 * (wide[0] + wide[-1]), 0.5 * (high[0] + high[-1])

    def off_px(self, scene: Scene, robots: list[SceneRobot]) -> float:
        """Return how far the robots of a scene are, at most, from where they are drawn."""
        worst = 0.0
        for robot in robots:
            found = self.disc(robot)
            if found is None:
                return float("inf")
            column, row = self.of(robot.x_m, robot.y_m)
            worst = max(worst, float(np.hypot(found[0] - column, found[1] - row)))
        return worst

    def ring(self, robot: SceneRobot) -> np.ndarray:
        """Return the middle colour of a robot's ring, (3,)."""
        angles = robot.heading_rad + np.linspace(0.7, 2 * np.pi - 0.7, 40)
        places = [
            self.of(
                robot.x_m + 0.84 * BODY_M * np.cos(angle), robot.y_m + 0.84 * BODY_M * np.sin(angle)
            )
            for angle in angles
        ]
        colours = [self.picture[round(row), round(column)] for column, row in places]
        return np.asarray(np.median(np.array(colours, dtype=float), axis=0))


WALL_PX = 5.0
"""How wide walls are drawn"""


def moments(seen: Watched) -> Iterator[tuple[float, Scene, list[SceneRobot]]]:
    """Return moments at which robots are so far from everything that nothing hides them, and those robots."""
    for at_s, scene in seen.checker.scenes:
        lonely = [robot for robot in scene.robots if room_m(scene, robot) > ROOM_M]
        if len(scene.robots) == ROBOTS and len(lonely) >= 2:
            yield at_s, scene, lonely


def look_at(seen: Watched, at_s: float, view: str) -> Picture:
    """Return a view as it was at a time."""
    seen.settle(at_s)
    seen.viewer.freeze(at_s)
    return seen.viewer.picture(view)


def test_every_robot_is_drawn_where_the_colony_says_it_is(seen: Watched) -> None:
    """At five moments the robots' discs are within two pixels of one of the scenes that had just come."""
    wait_until(lambda: sum(1 for _ in moments(seen)) >= 11, "robots stand apart at times")
    for at_s, _, _ in list(moments(seen))[1:11:2]:
        shown_s = at_s + 0.2
        picture = look_at(seen, shown_s, "Arena")
        off_px = {}
        for scene in seen.checker.scenes_within(shown_s - LATE_S, shown_s + 0.05):
            lonely = [robot for robot in scene.robots if room_m(scene, robot) > ROOM_M]
            if len(lonely) >= 2:
                off_px[scene.tick] = Pixels(picture, scene).off_px(scene, lonely)
        assert min(off_px.values()) < 2.0, off_px


def test_rings_are_in_the_colour_of_the_energy(seen: Watched) -> None:
    """A robot's ring has the hue of an energy that it told within the last second."""
    checked = 0
    for at_s, scene, lonely in list(moments(seen))[:5]:
        pixels = Pixels(look_at(seen, at_s + 0.15, "Arena"), scene)
        for robot in lonely:
            energies = seen.checker.energies(robot.robot, at_s - 1.2, at_s + 0.2)
            if not energies or pixels.off_px(scene, [robot]) > 6.0:
                continue
            found = _hue(pixels.ring(robot))
            message = [_hue(colour) for colour in palette.energy_colours(energies).astype(float)]
            assert max(float(found @ hue) for hue in message) > 0.985, (energies, found, message)
            checked += 1
    assert checked >= 4


def _hue(colour: np.ndarray) -> np.ndarray:
    return np.asarray(colour / max(1e-9, float(np.linalg.norm(colour))))


def test_a_mating_is_a_line_between_the_two_that_mated(seen: Watched) -> None:
    """A moment after two robots have told of their mating a bright line is between them, and soon none any more."""
    found = 0
    for at_s, mated in seen.checker.matings[:5]:
        lines: list[float | None] = []
        for shown_s in (at_s + 0.3, at_s + 4.0):
            picture = look_at(seen, shown_s, "Arena")
            if any(abs(shown_s - 0.7 - t) < 0.9 for t, _ in seen.checker.matings if t != at_s) and (
                shown_s > at_s + 1.0
            ):
                lines.append(None)
                continue
            scene = seen.checker.scenes_within(shown_s - LATE_S, shown_s)[-1]
            lines.append(_line_share(Pixels(picture, scene), scene, mated.encounter))
        if lines[0] is not None and lines[1] is not None:
            assert lines[1] < 0.2, "it has gone"
        found += lines[0] is not None and lines[0] > 0.8
    assert found >= 2


def _line_share(pixels: Pixels, scene: Scene, encounter: object) -> float | None:
    """Return how much of the way between two robots is drawn as a mating; None if one of them is not there."""
    where = {robot.robot: (robot.x_m, robot.y_m) for robot in scene.robots}
    one, other = (where.get(getattr(encounter, role)) for role in ("initiator", "responder"))
    if one is None or other is None:
        return None
    hits = []
    for share in np.linspace(0.3, 0.7, 21):
        x_m, y_m = ((1 - share) * a + share * b for a, b in zip(one, other, strict=True))
        column, row = pixels.of(x_m, y_m)
        around = pixels.picture[
            round(row) - 6 : round(row) + 7, round(column) - 6 : round(column) + 7
        ]
        near = [
            np.abs(around.astype(int) - colour).sum(axis=-1).min()
            for colour in (palette.CONCEIVED, palette.MATED)
        ]
        hits.append(min(near) < 30)
    return float(np.mean(hits))


def test_all_tabs_are_there_and_complain_of_nothing(seen: Watched) -> None:
    """Every tab is shown in turn: no view has an error or a warning, and the pictures of the tabs differ."""
    names = seen.viewer.names
    for part in ("Energy", "Matings of an agent", "Family", "Who (row)", "Log", "Now"):
        assert any(name.startswith(part) for name in names), (part, names)
    pictures = set()
    for number in range(len(TABS)):
        seen.viewer.turn_to(number)
        wait_until(lambda: not seen.viewer.client.get_state().loading, "it is loaded")
        pictures.add(seen.viewer.whole_picture().tobytes())
        assert seen.viewer.troubles() == []
    assert len(pictures) == len(TABS)
    seen.viewer.turn_to(0)


def test_a_robot_that_is_killed_turns_grey_and_comes_back(seen: Watched) -> None:
    """Three seconds after kill -9 its disc has no colour; when it has begun anew it has one again."""
    robot = seen.made.robots[-1]
    robot.kill()
    killed_s = time.time()
    wait_until(lambda: seen.viewer.until_s("wall") > killed_s + 3.5, "three seconds pass")
    picture = look_at(seen, killed_s + 3.0, "Arena")
    scene = seen.checker.scenes_within(killed_s + 2.6, killed_s + 3.0)[-1]
    body = next(r for r in scene.robots if r.robot == robot.id)
    assert np.ptp(Pixels(picture, scene).ring(body)) < 40
    robot.start()
    robot.wait_for("has body")
    back_s = time.time() + 1.5
    picture = look_at(seen, back_s, "Arena")
    scene = seen.checker.scenes_within(back_s - LATE_S, back_s)[-1]
    body = next(r for r in scene.robots if r.robot == robot.id)
    assert np.ptp(Pixels(picture, scene).ring(body)) > 60


def test_a_dashboard_that_is_killed_is_started_again_and_knows_what_was_before(
    seen: Watched, tmp_path: Path
) -> None:
    """A new dashboard, after kill -9 of the first, asks for the past: it draws births that were told before it came."""
    seen.dashboard.kill()
    again, url, out = seen.made.dashboard()
    with headless_viewer(url, tmp_path / "again.log") as viewer:
        wait_until(lambda: viewer.until_s("generation") > -1, "it shows the colony")
        wait_until(lambda: "/lineage/family" in viewer.entities(), "it draws a family")
        again.signal(signal.SIGTERM)
        assert again.wait(20.0) == 0
    from rerun.chunk import RrdReader

    rrd = out / "dashboard.rrd"
    paths = {str(chunk.entity_path) for chunk in RrdReader(str(rrd)).stream()}
    assert {"/arena/world/robots", "/lineage/family", "/network/robots"} <= paths
