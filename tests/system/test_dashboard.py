"""The dashboard shows the colony as it is: real processes, Rerun's own viewer, and its pixels.

A picture is taken at a moment at which the dashboard has drawn, and compared with the scene that it drew then, whose
tick is in its recording. How late it draws is asserted apart from that.
"""

import contextlib
import signal
import time
from bisect import bisect_right
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.view_model.pairings import MATING_S

from crcolony.protocol.identity import RobotId
from crcolony.protocol.mating_messages import Encounter
from crcolony.protocol.telemetry_messages import SILENT_AFTER_S, Scene, SceneRobot
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import open_session
from tests.support.arena_pixels import ROOM_M, Pixels
from tests.support.drawn_frames import DrawnFrames, Frame, Line, MatingLines, is_near
from tests.support.process import Process, wait_until
from tests.support.process_colony import Colony, colony
from tests.support.rerun_viewer import HeadlessViewer, Picture, headless_viewer
from tests.support.telemetry_recorder import TelemetryRecorder, room_m

ROBOTS = 4
HUNGRY = ("life.initial_energy=0.6", "life.energy_per_step=0.004", "arena.packs=2")

TABS = ("Colony", "Evolution", "Genes", "Life", "Lineage", "Network", "Log")
MAX_LAG_S = 3.0
"""From the arrival of telemetry to its drawing, on a busy machine"""
MAX_STATE_AGE_S = 6.0
"""Of a state whose energy is drawn: without a newer one for so long, robots are drawn grey"""
PICTURE_TIMEOUT_S = 60.0

Measure = Callable[[Picture], float]


@dataclass
class WatchedColony:
    """A colony of processes, its dashboard with a viewer and its drawings, and a recorder of the colony's telemetry."""

    made: Colony
    dashboard: Process
    drawn: DrawnFrames
    viewer: HeadlessViewer
    recorder: TelemetryRecorder

    def frames(self) -> list[tuple[Frame, Scene]]:
        """Return what was drawn so far, with the scene that was drawn, where the recorder received it too."""
        scenes = {scene.tick: scene for _, scene in list(self.recorder.scenes)}
        drawn = self.drawn.frames
        return [(frame, scenes[frame.tick]) for frame in drawn if frame.tick in scenes]

    def wait_for(self, found: Callable[[], object], what: str) -> None:
        """Wait for something in the recording, which is flushed every two seconds."""
        wait_until(lambda: self.drawn.update() and found(), what, 120.0)

    def picture(
        self, unix_s: float, measure: Measure, is_right: Callable[[float], bool]
    ) -> tuple[Picture, float]:
        """Return the arena as it was drawn at a time, and what is measured in that picture.

        The viewer stands still at that time, but may not have received all drawings yet: pictures are taken until one
        is right, or for long enough to show that none is.
        """
        self.viewer.freeze(unix_s + 1e-3)
        deadline_s = time.monotonic() + PICTURE_TIMEOUT_S
        while True:
            picture = self.viewer.picture("Arena")
            value = measure(picture)
            if is_right(value) or time.monotonic() > deadline_s:
                return picture, value


@contextlib.contextmanager
def watched_colony(folder: Path) -> Iterator[WatchedColony]:
    """A colony that has mated, and everything that is needed to watch it."""
    with contextlib.ExitStack() as stack:
        made = stack.enter_context(colony(folder, *HUNGRY))
        made.arena(ROBOTS, "--hz", "10")
        dashboard, url, out = made.dashboard()
        for number in range(ROBOTS):
            made.robot("--number", str(number))
        session = stack.enter_context(open_session(NetworkSettings(connect=(made.endpoint,))))
        recorder = TelemetryRecorder(session)
        viewer = stack.enter_context(headless_viewer(url, folder / "viewer.log"))
        wait_until(lambda: len(recorder.matings) >= 6, "robots mate", 120.0)
        drawn = DrawnFrames(out / "dashboard.rrd")
        yield WatchedColony(made, dashboard, drawn, viewer, recorder)


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> Iterator[WatchedColony]:
    """A colony that all tests of this file share."""
    with watched_colony(tmp_path_factory.mktemp("seen")) as watched:
        yield watched


def isolated_frames(seen: WatchedColony) -> list[tuple[Frame, Scene, list[SceneRobot]]]:
    """Return frames in which no robot is missing or grey and at least two are isolated, and those."""
    found = []
    for frame, scene in seen.frames():
        isolated = [robot for robot in scene.robots if room_m(scene, robot) > ROOM_M]
        has_all = (
            len(scene.robots) == len(frame.rings) == ROBOTS and palette.STALE not in frame.rings
        )
        if has_all and len(isolated) >= 2:
            found.append((frame, scene, isolated))
    return found


def spread_out(seen: WatchedColony, count: int) -> list[tuple[Frame, Scene, list[SceneRobot]]]:
    """Return so many frames with isolated robots, from the first to the last."""
    seen.wait_for(lambda: len(isolated_frames(seen)) >= 3 * count, "robots are isolated at times")
    found = isolated_frames(seen)
    return found[:: len(found) // count][:count]


def largest_offset_px(picture: Picture, scene: Scene, robots: list[SceneRobot]) -> float:
    """Return how far the discs are from the robots at most; infinity if there is no arena on the picture."""
    try:
        return Pixels(picture, scene).off_px(robots)
    except ValueError:
        return float("inf")


def test_scenes_are_drawn_soon_after_they_arrived(seen: WatchedColony) -> None:
    """Half of them within a second, nine of ten within three, however busy the machine is."""
    spread_out(seen, 5)
    received_s = {scene.tick: at_s for at_s, scene in reversed(list(seen.recorder.scenes))}
    drawn_s = {frame.tick: frame.unix_s for frame, _ in reversed(seen.frames())}
    lags_s = [drawn_s[tick] - received_s[tick] for tick in drawn_s]
    assert len(lags_s) > 30
    median_s, late_s = np.quantile(lags_s, (0.5, 0.9))
    assert median_s < 1.0
    assert late_s < MAX_LAG_S


def test_every_robot_is_drawn_where_the_colony_says_it_is(seen: WatchedColony) -> None:
    """At five moments the robots' discs are within two pixels of their positions in the scene that was drawn."""
    for frame, scene, isolated in spread_out(seen, 5):
        off_px = partial(largest_offset_px, scene=scene, robots=isolated)
        _, distance_px = seen.picture(frame.unix_s, off_px, lambda px: px < 2.0)
        assert distance_px < 2.0, (frame, scene)


def test_rings_are_in_the_colour_of_the_energy(seen: WatchedColony) -> None:
    """A robot's ring has the colour of an energy that it published shortly before."""
    for frame, scene, isolated in spread_out(seen, 5):
        off_px = partial(largest_offset_px, scene=scene, robots=isolated)
        picture, _ = seen.picture(frame.unix_s, off_px, lambda px: px < 2.0)
        pixels = Pixels(picture, scene)
        for robot in isolated:
            drawn = frame.rings[scene.robots.index(robot)]
            energies = seen.recorder.energies(
                robot.robot, frame.unix_s - MAX_STATE_AGE_S, frame.unix_s + 1.0
            )
            colours = [tuple(colour) for colour in palette.energy_colours(energies).tolist()]
            assert drawn in colours, (drawn, energies)
            ring = pixels.ring(robot)
            assert float(_hue(ring) @ _hue(np.array(drawn, dtype=float))) > 0.985, (drawn, ring)


def _hue(colour: np.ndarray) -> np.ndarray:
    return np.asarray(colour / max(1e-9, float(np.linalg.norm(colour))))


@dataclass(frozen=True)
class DrawnMating:
    """A mating whose line was drawn, and removed again."""

    encounter: Encounter
    first: MatingLines
    """The first drawing of its line"""
    scene: Scene
    """That was drawn then"""
    last_s: float
    """When the last mating of the two robots arrived before the line was removed"""
    after: MatingLines
    """The first drawing without it"""
    scene_after: Scene


def drawn_matings(seen: WatchedColony) -> list[DrawnMating]:
    """Return the matings so far whose lines were drawn and removed, with no other line in their place afterwards."""
    frames, drawings = seen.frames(), seen.drawn.mating_lines
    frame_times_s = [frame.unix_s for frame, _ in frames]
    times_s = [drawing.unix_s for drawing in drawings]
    reports = [(at_s, mated.encounter) for at_s, mated in list(seen.recorder.matings)]

    def scene_at(unix_s: float) -> Scene:
        return frames[max(0, bisect_right(frame_times_s, unix_s) - 1)][1]

    def has_line(drawing: MatingLines, encounter: Encounter) -> bool:
        ends = _ends(scene_at(drawing.unix_s), encounter)
        return ends is not None and any(is_near(ends, line) for line in drawing.lines)

    found: dict[Encounter, DrawnMating] = {}
    for at_s, encounter in reports:
        start = bisect_right(times_s, at_s - 0.5)
        if encounter in found or (start > 0 and has_line(drawings[start - 1], encounter)):
            continue
        soon = drawings[start : bisect_right(times_s, at_s + MAX_LAG_S)]
        first = next((drawing for drawing in soon if has_line(drawing, encounter)), None)
        if first is None:
            continue
        later = drawings[drawings.index(first) :]
        after = next((drawing for drawing in later if not has_line(drawing, encounter)), None)
        ends = _ends(scene_at(after.unix_s), encounter) if after is not None else None
        if after is None or ends is None or min_gap_m(ends, after.lines) < 0.05:
            continue
        last_s = max(
            s for s, other in reports if is_same_pair(other, encounter) and s < after.unix_s
        )
        scene, scene_after = scene_at(first.unix_s), scene_at(after.unix_s)
        found[encounter] = DrawnMating(encounter, first, scene, last_s, after, scene_after)
    return list(found.values())


def is_same_pair(one: Encounter, other: Encounter) -> bool:
    """Return whether two encounters are of the same two robots."""
    return {one.initiator, one.responder} == {other.initiator, other.responder}


def between(ends: Line) -> np.ndarray:
    """Return 21 points on the middle part of a line, where no disc hides it, (21, 2)."""
    one, other = np.array(ends)
    return np.asarray(one + np.linspace(0.3, 0.7, 21)[:, None] * (other - one))


def min_gap_m(ends: Line, lines: list[Line]) -> float:
    """Return the smallest distance of the middle part of a line to some others."""
    gaps_m = [float("inf")]
    for one, other in np.array(lines).reshape(-1, 2, 2):
        along = (other - one) / max(1e-12, float((other - one) @ (other - one)))
        shares = np.clip((between(ends) - one) @ along, 0.0, 1.0)
        nearest = one + shares[:, None] * (other - one)
        gaps_m.append(float(np.linalg.norm(between(ends) - nearest, axis=1).min()))
    return min(gaps_m)


def test_a_mating_is_a_line_between_the_two_that_mated(seen: WatchedColony) -> None:
    """Soon after a mating arrived a bright line joins the two robots, and it is removed again."""
    seen.wait_for(lambda: len(drawn_matings(seen)) >= 3, "matings are drawn")
    for mating in drawn_matings(seen)[:3]:
        share = partial(line_share, scene=mating.scene, encounter=mating.encounter)
        _, drawn = seen.picture(mating.first.unix_s, share, lambda value: value > 0.8)
        assert drawn > 0.8, mating
        assert mating.after.unix_s - mating.last_s < MATING_S + MAX_LAG_S
        share = partial(line_share, scene=mating.scene_after, encounter=mating.encounter)
        _, drawn = seen.picture(mating.after.unix_s, share, lambda value: value < 0.2)
        assert drawn < 0.2, mating


def _ends(scene: Scene, encounter: Encounter) -> Line | None:
    """Return the positions of the two robots of an encounter; None if one of them has no body in the scene."""
    points = {robot.robot: (robot.x_m, robot.y_m) for robot in scene.robots}
    one, other = points.get(encounter.initiator), points.get(encounter.responder)
    return (one, other) if one is not None and other is not None else None


def line_share(picture: Picture, scene: Scene, encounter: Encounter) -> float:
    """Return how much of the way between two robots is drawn as a mating; NaN if there is no arena on the picture."""
    ends = _ends(scene, encounter)
    assert ends is not None
    try:
        pixels = Pixels(picture, scene)
    except ValueError:
        return float("nan")
    hits = []
    for x_m, y_m in between(ends):
        column, row = pixels.of(x_m, y_m)
        around = picture[round(row) - 6 : round(row) + 7, round(column) - 6 : round(column) + 7]
        nearest = [
            np.abs(around.astype(int) - colour).sum(axis=-1).min()
            for colour in (palette.CONCEIVED, palette.MATED)
        ]
        hits.append(min(nearest) < 30)
    return float(np.mean(hits))


def test_all_tabs_are_there_without_errors(seen: WatchedColony) -> None:
    """Every tab is shown in turn: no view has an error or a warning, and the pictures of the tabs differ."""
    names = seen.viewer.names
    for part in ("Energy", "Matings of an agent", "Family", "Peers", "Log", "Now"):
        assert any(name.startswith(part) for name in names), (part, names)
    pictures = set()
    for number in range(len(TABS)):
        seen.viewer.turn_to(number)
        wait_until(lambda: not seen.viewer.client.get_state().loading, "the tab is loaded")
        pictures.add(seen.viewer.whole_picture().tobytes())
        assert seen.viewer.reports() == []
    assert len(pictures) == len(TABS)
    seen.viewer.turn_to(0)


def test_a_robot_that_is_killed_turns_grey_and_comes_back(seen: WatchedColony) -> None:
    """After kill -9 its ring is drawn grey; after a restart it has the colour of its energy again."""
    robot = seen.made.robots[-1]
    robot.kill()
    frame, scene = _frame_after(seen, time.time(), robot.id, is_grey=True)
    colourfulness = partial(ring_colourfulness, scene=scene, robot=robot.id)
    _, value = seen.picture(frame.unix_s, colourfulness, lambda value: value < 40)
    assert value < 40
    robot.start()
    robot.wait_for("has body")
    frame, scene = _frame_after(seen, time.time(), robot.id, is_grey=False)
    colourfulness = partial(ring_colourfulness, scene=scene, robot=robot.id)
    _, value = seen.picture(frame.unix_s, colourfulness, lambda value: value > 60)
    assert value > 60


def _frame_after(
    seen: WatchedColony, unix_s: float, robot: RobotId, is_grey: bool
) -> tuple[Frame, Scene]:
    """Wait for the first frame after a time in which a robot is grey, or not; it must come soon."""

    def found() -> list[tuple[Frame, Scene]]:
        return [
            (frame, scene)
            for frame, scene in seen.frames()
            for body, colour in zip(scene.robots, frame.rings, strict=True)
            if body.robot == robot
            and (colour == palette.STALE) == is_grey
            and frame.unix_s > unix_s
        ]

    seen.wait_for(found, f"{robot.hex()} is {'grey' if is_grey else 'coloured'}")
    frame, scene = found()[0]
    assert frame.unix_s < unix_s + SILENT_AFTER_S + MAX_LAG_S
    return frame, scene


def ring_colourfulness(picture: Picture, scene: Scene, robot: RobotId) -> float:
    """Return how far the parts of the colour of a robot's ring differ; NaN if there is no arena on the picture."""
    body = next(body for body in scene.robots if body.robot == robot)
    try:
        return float(np.ptp(Pixels(picture, scene).ring(body)))
    except ValueError:
        return float("nan")


def test_a_dashboard_that_is_killed_and_restarted_requests_the_history(
    seen: WatchedColony, tmp_path: Path
) -> None:
    """After kill -9 a new dashboard draws births that were published before it started."""
    seen.dashboard.kill()
    again, url, out = seen.made.dashboard()
    with headless_viewer(url, tmp_path / "again.log") as viewer:
        wait_until(lambda: viewer.until_s("generation") > -1, "the colony is drawn")
        wait_until(lambda: "/lineage/family" in viewer.entities(), "a family tree is drawn")
        again.signal(signal.SIGTERM)
        assert again.wait(20.0) == 0
    from rerun.chunk import RrdReader

    rrd = out / "dashboard.rrd"
    paths = {str(chunk.entity_path) for chunk in RrdReader(str(rrd)).stream()}
    assert {"/arena/world/robots", "/lineage/family", "/network/robots"} <= paths
