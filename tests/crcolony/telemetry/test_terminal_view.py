"""The terminal shows every robot with its state, and the arenas, as a table, as a line, and as JSON."""

import json

import msgspec
import pytest
from rich.console import Console

from crcolony.protocol.telemetry_messages import SILENT_AFTER_S, Activity
from crcolony.telemetry.colony_monitor import ColonyMonitor
from crcolony.telemetry.terminal_view import as_dict, headline, plain_line, table_of
from tests.support.fed_monitor import A_SCENE, ARENA, COLONY, ME, PEER, FedMonitor, T, state


@pytest.fixture
def monitor() -> FedMonitor:
    """Two robots online, one of which has published its state, and an arena."""
    monitor = FedMonitor()
    monitor.online(3, ME)
    monitor.online(3, PEER)
    changes = {"number": 7, "energy": 0.5, "generation": 4, "matings": 6, "conceptions": 2}
    monitor.state(msgspec.structs.replace(state(), **changes))
    monitor.handle("online", ARENA.alive(7, "a"))
    monitor.handle("scene", ARENA.scene, A_SCENE)
    return monitor


def shown(monitor: ColonyMonitor, unix_s: float) -> list[str]:
    """Return the lines of the table."""
    console = Console(width=140, color_system=None, markup=False)
    with console.capture() as capture:
        console.print(table_of(monitor, unix_s, width=140))
    return capture.get().splitlines()


def test_the_table_has_a_row_for_every_robot(monitor: FedMonitor) -> None:
    """With its state, if it has published one."""
    title, _, first, second = shown(monitor, T + 1.0)
    assert title.startswith("2 robots alive   arena lab: tick ")
    assert first.split()[:3] == [ME.hex()[:8], "#7", "alive"]
    assert "████░░░░ 0.50" in first
    assert "1.0 s" in first
    assert second.split() == [PEER.hex()[:8], "alive"]


@pytest.mark.parametrize(
    ("width", "columns"),
    [
        (120, "robot energy module gen matings children pool doubt age lost"),
        (80, "robot energy module gen matings children pool"),
        (60, "robot energy module gen matings"),
        (40, "robot energy gen matings"),
        (10, "robot energy"),
    ],
)
def test_columns_that_do_not_fit_are_left_out_whole(
    monitor: FedMonitor, width: int, columns: str
) -> None:
    """What matters least first; name and energy stay, and nothing that is shown is cut."""
    console = Console(width=max(width, 26), color_system=None, markup=False)
    with console.capture() as capture:
        console.print(table_of(monitor, T + 1.0, width=width))
    lines = capture.get().splitlines()
    heads = next(line for line in lines if line.startswith("robot"))
    assert heads.split() == columns.split()
    assert f"{ME.hex()[:8]} #7" in capture.get()
    assert "████░░░░ 0.50" in capture.get()
    assert "…" not in capture.get()


def test_a_robot_is_alive_silent_or_offline(monitor: FedMonitor) -> None:
    """Silent: it is online and has not published its state for long."""
    assert "silent" in shown(monitor, T + SILENT_AFTER_S + 0.1)[2]
    monitor.offline(3, ME)
    assert "offline" in shown(monitor, T)[2]


def test_restarts_are_counted(monitor: FedMonitor) -> None:
    """Behind the robot's presence."""
    monitor.online(4, ME, session="b")
    monitor.state(state(incarnation=4))
    assert "(1 restarts)" in shown(monitor, T)[2]


def test_without_robots_the_table_says_what_is_awaited() -> None:
    """That there is no arena, and where nobody answers."""
    monitor = FedMonitor()
    assert headline(monitor, T) == "0 robots alive   no arena online"
    assert shown(monitor, T)[-1].strip() == "waiting for robots and an arena to come online …"
    assert plain_line(monitor, T).endswith("waiting for robots and an arena to come online …")
    assert plain_line(monitor, T, ["nobody answers"]).endswith("no arena online   nobody answers")


def test_a_robot_that_starts_is_shown_with_what_it_does() -> None:
    """And so is an arena; both as long as they say so, and until they are online."""
    monitor = FedMonitor()
    monitor.handle("activity", COLONY.activity(ME), Activity(7, "compiling the step", 4, 10))
    monitor.handle("activity", ARENA.activity, Activity(7, "compiling the world", 1, 2))
    title = "0 robots alive, 1 starting   arena lab: compiling the world, 50 %"
    assert headline(monitor, T + 1.0) == title
    row = shown(monitor, T + 1.0)[2]
    assert row.split()[:3] == [ME.hex()[:8], "starting", "compiling"]
    assert "compiling the step, 40 %" in row
    assert plain_line(monitor, T + 1.0) == f"{title}   compiling the step, 40 %"
    assert headline(monitor, T + 3.0) == "0 robots alive   arena lab: offline"
    monitor.online()
    monitor.handle("online", ARENA.alive(7, "a"))
    assert headline(monitor, T + 1.0) == "1 robots alive   arena lab: 0 bodies, no scene"


def test_a_robot_without_a_body_is_shown_with_what_it_waits_for() -> None:
    """Until it has a body."""
    monitor = FedMonitor()
    monitor.online()
    monitor.state(msgspec.structs.replace(state(), arena=""))
    monitor.handle("activity", COLONY.activity(ME), Activity(7, "waiting for arena lab", 0, 0))
    assert "waiting for arena lab" in shown(monitor, T + 1.0)[2]
    assert "no body" in shown(monitor, T + 3.0)[2]
    monitor.now_s = T + 1.0
    monitor.state(msgspec.structs.replace(state(), arena="lab"))
    assert "waiting" not in shown(monitor, T + 1.0)[2]


def test_the_headline_shows_the_arenas(monitor: FedMonitor) -> None:
    """Offline ones, and those without a scene, too."""
    monitor.handle("offline", ARENA.alive(7, "a"))
    monitor.handle("online", "crcolony/1/arena/other/alive/1/a")
    title = "2 robots alive   arena lab: offline   arena other: 0 bodies, no scene"
    assert headline(monitor, T) == title


def test_where_there_are_several_arenas_the_table_says_in_which_a_body_is(
    monitor: FedMonitor,
) -> None:
    """A bridge is one whose bodies nobody sees from above."""
    assert "arena" not in shown(monitor, T)[1].split()
    monitor.handle("online", "crcolony/1/arena/bridge/alive/1/a")
    monitor.state(msgspec.structs.replace(state(robot=PEER), arena="bridge"))
    assert headline(monitor, T).endswith("arena bridge: 1 bodies, no scene   arena lab: tick 70000")
    assert "arena" in shown(monitor, T)[1].split()
    assert any("bridge" in row for row in shown(monitor, T)[2:])


def test_the_line_summarises_the_robots(monitor: FedMonitor) -> None:
    """The lowest generation, sums, and the mean energy; each mating counts for two robots."""
    monitor.state(
        msgspec.structs.replace(
            state(robot=PEER), energy=1.0, generation=3, matings=4, conceptions=1
        )
    )
    assert plain_line(monitor, T).startswith("2 robots alive   arena lab: tick ")
    assert plain_line(monitor, T).endswith("   generation 3, matings 5, offspring 3, energy 0.75")


def test_json_has_all_fields_of_every_robot(monitor: FedMonitor) -> None:
    """Null where a robot has not published its state."""
    result = json.loads(json.dumps(as_dict(monitor, T + 2.0)))
    known, unknown = result["robots"]
    assert (known["id"], known["colony"], known["alive"]) == (ME.hex(), "blue", True)
    assert (known["number"], known["energy"], known["age_s"], known["missed"]) == (7, 0.5, 2.0, 0)
    assert unknown == {
        "id": PEER.hex(),
        "colony": "blue",
        "alive": True,
        "doing": "",
        "energy": None,
        "generation": None,
        "matings": None,
    }
    assert [(a["name"], a["alive"], a["doing"]) for a in result["arenas"]] == [("lab", True, "")]
