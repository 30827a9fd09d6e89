"""All tabs together: everything received is drawn, no view stays empty, and no implausible data stop it."""

from collections.abc import Iterator
from typing import Any, cast

import pytest
import rerun.blueprint as rrb
from crcolony_dashboards.dashboard import Dashboard
from crcolony_dashboards.rerun_streams import Moment
from hypothesis import given, settings
from hypothesis import strategies as st

from crcolony.protocol.telemetry_messages import Fault, RobotEvent
from crcolony.telemetry.colony_monitor import ColonyMonitor
from crcolony.telemetry.presence import FORGET_S
from crcolony.telemetry.status_changes import RobotJoined, RobotLeft
from tests.support.drawn import Drawing, RecordingStreams
from tests.support.fake_telemetry import (
    IDS,
    SCHEMA,
    FakeTelemetry,
    T,
    agent,
    born,
    lived,
    mated,
    met,
)

TABS = ["Colony", "Evolution", "Genes", "Life", "Lineage", "Network", "Log"]


class DashboardHarness:
    """A dashboard that draws made-up telemetry on recording streams."""

    def __init__(self) -> None:
        self.dashboard, self.streams = Dashboard(ColonyMonitor()), RecordingStreams()
        self.telemetry = FakeTelemetry(self.dashboard.view)
        self.dashboard.setup(self.streams)

    def draw(self, after_s: float = 0.1) -> RecordingStreams:
        self.telemetry.at_s += after_s
        self.streams.clear()
        self.dashboard.draw(self.streams, self.telemetry.at_s)
        return self.streams


@pytest.fixture
def show() -> DashboardHarness:
    return DashboardHarness()


def live(telemetry: FakeTelemetry) -> None:
    """Publish everything that two robots publish in a generation."""
    telemetry.arena_metadata()
    telemetry.scene((0, -0.5, 0.0), (1, 0.5, 0.0), packs=[(0.0, 0.5, 0.4)], tick=5_000)
    telemetry.join(0, 1, arena="lab", generation=1, matings=0, tick=5_000)
    for robot in (0, 1):
        telemetry.robot_metadata(robot, 1 - robot)
        genes = [0.1] * len(SCHEMA)
        telemetry.events(robot, born(agent(robot, 0), 0, genes), met(1 - robot), mated(0, 1))
        telemetry.events(robot, lived(agent(robot, 0)), born(agent(robot, 1), 1, genes))
        telemetry.events(robot, Fault(1, "x"))


def views(container: Any) -> Iterator[Any]:
    for inner in container.contents:
        if isinstance(inner, rrb.Container):
            yield from views(inner)
        else:
            yield inner


def test_there_are_seven_tabs() -> None:
    """In this order; the first is open."""
    dashboard = Dashboard(ColonyMonitor())
    assert [tab.layout().name for tab in dashboard.tabs] == TABS
    for timeline, is_live in (("wall", True), ("sim", False)):
        blueprint = dashboard.blueprint(timeline, is_live)
        assert [tab.name for tab in blueprint.root_container.contents] == TABS


def test_every_view_shows_something_and_everything_has_a_view(show: DashboardHarness) -> None:
    """After one generation of a colony."""
    live(show.telemetry)
    paths = set(show.streams.paths())
    for k in range(30):
        show.telemetry.scene((0, -0.5, 0.0), (1, 0.5, 0.0), tick=5_000 + k)
        show.telemetry.state(0, 1, arena="lab", generation=1, matings=2, tick=5_000)
        paths |= set(show.draw().paths())
    origins = [view.origin for view in views(show.dashboard.blueprint("wall", True).root_container)]
    assert len(origins) > 20

    def shows(origin: str, path: str) -> bool:
        return f"{path}/".startswith(f"{origin}/")

    assert [o for o in origins if not any(shows(o, path) for path in paths)] == []
    assert [path for path in paths if not any(shows(o, path) for o in origins)] == []


def test_lines_are_styled_once(show: DashboardHarness) -> None:
    """As static data: viewers that connect late receive them, and a recording has them once."""
    live(show.telemetry)
    styled = [drawing for drawing in show.streams.drawings if is_style(drawing)]
    for k in range(40):
        show.telemetry.state(
            0, 1, arena="lab", generation=1 + k // 20, matings=k, tick=5_000 + 5 * k
        )
        show.telemetry.scene((0, -0.5, 0.0), (1, 0.5, 0.0), tick=5_000 + 5 * k)
        if k == 20:
            for robot in (0, 1):
                show.telemetry.events(robot, lived(agent(robot, 1), 1), born(agent(robot, 2), 2))
        styled += [drawing for drawing in show.draw().drawings if is_style(drawing)]
    paths = [drawing.path for drawing in styled]
    assert len(paths) == len(set(paths)) > 15
    assert all(drawing.is_static for drawing in styled)


def is_style(drawing: Drawing) -> bool:
    return not {"scalars", "state", "variances"} & set(drawing.parts) and bool(
        {"names", "widths", "markers", "values"} & set(drawing.parts)
    )


def test_drawings_have_the_current_time(show: DashboardHarness) -> None:
    """On all three timelines: wall clock, the colony's time (0 before it is known), and the lowest generation."""
    show.telemetry.online(0)
    streams = show.draw(1.0)
    assert {drawing.moment for drawing in streams.drawings} == {Moment(T + 1.0, 0.0, 0)}
    show.telemetry.scene((0, 0.0, 0.0), tick=50)
    show.telemetry.state(0, generation=3)
    streams = show.draw(1.0)
    assert {drawing.moment for drawing in streams.drawings} == {Moment(T + 2.0, 10.0, 3)}


def test_changes_are_processed_in_order(show: DashboardHarness) -> None:
    """In the order of the list."""
    show.dashboard.handle_changes([RobotJoined(IDS[0]), RobotLeft(IDS[0]), RobotJoined(IDS[0])], T)
    show.draw(1.0)
    texts = [drawing.parts["text"].to_pylist()[0] for drawing in show.streams.drawings
            if drawing.path == "/log"]  # fmt: skip
    assert [text.rpartition(" ")[2] for text in texts] == ["online", "offline", "online"]


def test_rates_are_sampled_once_a_second(show: DashboardHarness) -> None:
    """By the dashboard, not by a tab."""
    show.telemetry.join(0, matings=0)
    for second in range(8):
        show.telemetry.state(0, matings=second)
        show.draw(1.0)
    samples = show.dashboard.view.colonies["blue"].rates.samples
    assert len(samples) == pytest.approx(8, abs=1)
    assert show.streams.scalars("/life/rates/matings_blue") == [[pytest.approx(60.0)]]


def test_robots_that_are_long_offline_are_dropped(show: DashboardHarness) -> None:
    """In the end there is none."""
    live(show.telemetry)
    show.telemetry.offline(0, 1)
    show.draw(1.0)
    assert len(show.telemetry.monitor.robots) == 2
    streams = show.draw(FORGET_S + 2.0)
    assert show.telemetry.monitor.robots == {}
    assert streams.text("/network/robots") == "No robot is on the network yet."


def test_a_silent_colony_is_not_drawn_all_the_time(show: DashboardHarness) -> None:
    """Only text and a few numbers a second, and pictures from time to time for viewers that connect late."""
    live(show.telemetry)
    for _ in range(40):
        show.draw(1.0)
    paths = [path for _ in range(300) for path in show.draw(0.1).paths()]
    assert not [path for path in paths if path.startswith("/arena/world")]
    for picture in ("/network/peer_matrix", "/lineage/family", "/genes/potential/mating"):
        assert 1 <= paths.count(picture) <= 2
    assert len(paths) < 30 * 30


NUMBERS = st.sampled_from(
    [0.0, -1.0, 1.0, 1e-320, 1e9, -1e300, float("inf"), -float("inf"), float("nan")]
)
WHOLE = st.sampled_from([0, 1, 2, -1, 2**31, 2**53 - 1, -(2**63), 2**64 - 1])
COUNTS = st.sampled_from([0, 1, 2**31 - 1])
NAMES = st.sampled_from([agent(0, 0), agent(1, 1), "", "x", "/", "x" * 5_000, "\0\n|#"])
PARENTS = st.fixed_dictionaries({}, optional={"mother": NAMES, "father": NAMES})
BIRTHS = st.builds(
    lambda name, generation, genes, parents: born(name, generation, genes, **parents),
    NAMES, WHOLE, st.lists(NUMBERS, max_size=3), PARENTS,
)  # fmt: skip
LIVES = st.builds(
    lambda name, number, tick, energy, count: lived(
        name, number, tick=tick, energy=energy, captures=count, matings=count
    ),
    NAMES, WHOLE, WHOLE, NUMBERS, WHOLE,
)  # fmt: skip
WORDS = st.text(max_size=5)
EVENTS = st.one_of(
    BIRTHS, LIVES, st.builds(Fault, COUNTS, WORDS), st.builds(mated, COUNTS.map(lambda k: k % 2),
    st.just(2), COUNTS), st.builds(met, st.just(0)),
)  # fmt: skip
SIZES = st.fixed_dictionaries({}, optional={
    "width_m": NUMBERS, "height_m": NUMBERS, "period_s": NUMBERS,
    "tick": st.sampled_from([0, 2**53 - 1]),
})  # fmt: skip
BODIES = st.tuples(st.sampled_from([0, 1, 7]), NUMBERS, NUMBERS, NUMBERS)
STATES = st.fixed_dictionaries({}, optional={
    "tick": st.sampled_from([0, 2**53 - 1]), "generation": st.sampled_from([0, 2**53 - 1]),
    "module": st.sampled_from([-1, 1, 99]), "agent": st.sampled_from(["", agent(0, 0), "x"]),
    "arena": st.sampled_from(["", "lab"]), "number": COUNTS, "seq": COUNTS,
})  # fmt: skip
SETTINGS = st.sampled_from([
    "{}", '{"body":{"camera_range_m":1e-320},"learning":{},"heredity":{}}',
    '{"body":{"camera_half_angle_rad":0},"learning":{"shaping":false},"heredity":{}}',
    '{"body":{},"learning":{"potential_distances":1},"heredity":{"highest_alpha":0}}',
])  # fmt: skip


@settings(max_examples=50)
@given(st.data())
def test_implausible_telemetry_does_not_stop_it(data: st.DataObject) -> None:
    """Whatever peers publish, plausible telemetry is drawn afterwards."""
    show = DashboardHarness()
    telemetry = show.telemetry
    telemetry.join(0, 1)
    for _ in range(data.draw(st.integers(1, 8))):
        robot = data.draw(st.integers(0, 2))
        match data.draw(st.sampled_from(["event", "scene", "state", "metadata", "go", "come"])):
            case "event":
                event: RobotEvent = data.draw(EVENTS)
                told_s = data.draw(st.sampled_from([None, 0.0, 9e12]))
                telemetry.events(robot, event, told_s=told_s)
            case "scene":
                packs = data.draw(st.lists(st.tuples(NUMBERS, NUMBERS, st.just(0.4)), max_size=2))
                bodies = data.draw(st.lists(BODIES, max_size=2))
                telemetry.scene(*bodies, packs=packs, **cast(Any, data.draw(SIZES)))
            case "state":
                telemetry.state(robot, **cast(Any, data.draw(STATES)))
            case "metadata":
                telemetry.robot_metadata(robot, settings=data.draw(SETTINGS))
            case "go":
                telemetry.offline(robot)
            case _:
                telemetry.online(robot)
        show.draw(data.draw(st.sampled_from([0.1, 1.0, 11.0, -5.0])))
    telemetry.at_s = max(telemetry.at_s, T) + 20.0
    telemetry.offline(0, 1, 2)
    live(telemetry)
    show.draw(1.0)
    streams = show.draw(1.0)
    assert streams.shown("/arena/world/robots", "positions") == [[-0.5, 0.0], [0.5, 0.0]]
    assert "2 robots online" in streams.text("/colony/now")
