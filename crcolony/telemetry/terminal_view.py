"""Shows the state of a colony in the terminal: `crcolony top` and `crcolony status`."""

import json
import threading
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from rich.cells import cell_len
from rich.live import Live
from rich.table import Table
from rich.text import Text

from crcolony.protocol.telemetry_messages import SILENT_AFTER_S
from crcolony.shutdown import ShutdownSignal
from crcolony.telemetry.colony_monitor import ColonyMonitor
from crcolony.telemetry.notices import format_arena_change, notices
from crcolony.telemetry.robot_status import ArenaStatus, RobotStatus
from crcolony.telemetry.status_changes import ArenaChanged
from crcolony.telemetry.subscriber import TelemetrySubscriber
from crcolony.telemetry.wait_for_states import wait_for_states
from crcolony.terminal import plain_console
from crcolony.transport.brief_session import brief_session
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.wait_for_network import open_connection

_REFRESH_S = 0.25
"""Between two updates of the table."""
_PLAIN_LINES_S = 5.0
"""Between two lines where the output is no terminal."""
_TABLE_WIDTH = 110
"""Of a table where the output is no terminal."""
_ORDER = (
    "robot", "", "arena", "energy", "module", "gen", "matings", "children", "pool", "doubt", "age", "lost",
)  # fmt: skip
"""The columns of the table."""
_MODULES = {0: "foraging", 1: "mating"}
_GAP = 2
"""Between two columns."""
_NUMBERS = ("gen", "matings", "children", "pool", "doubt", "age", "lost")
"""Columns that are aligned to the right."""
_DROPPED = ("lost", "age", "doubt", "pool", "children", "module", "", "arena", "gen", "matings")
"""Columns that a narrow terminal does not show, in the order in which they are left out."""


def run_top(network: NetworkSettings, colony: str, seconds: float | None) -> int:
    """Show the colony until Ctrl-C or for some seconds; where the output is no terminal, print a line every 5 s."""
    console = plain_console()
    woken = threading.Event()
    stop = ShutdownSignal(seconds / 60.0 if seconds else None, wake=woken.set)

    def print_line(line: str) -> None:
        console.print(line, soft_wrap=True)

    with open_connection(network, stop, print_line) as connection:
        if connection is None:
            return 0
        subscriber = TelemetrySubscriber(connection.session, colony, sends_requests=True)
        connection.add_user(subscriber)

        def poll() -> tuple[ColonyMonitor, float, list[str]]:
            connection.handle_timers(time.monotonic())
            for change in subscriber.poll():
                if isinstance(change, ArenaChanged):
                    print_line(format_arena_change(change))
            return subscriber.monitor, time.time(), connection.check.problems

        if console.is_terminal:
            with Live(console=console, refresh_per_second=4, screen=False) as live:
                while not stop():
                    live.update(table_of(*poll(), width=console.width))
                    woken.wait(_REFRESH_S)
        else:
            while not stop():
                woken.wait(min(_PLAIN_LINES_S, seconds or _PLAIN_LINES_S))
                print_line(plain_line(*poll()))
    return 0


def table_of(
    monitor: ColonyMonitor, unix_s: float, problems: Sequence[str] = (), width: int = _TABLE_WIDTH
) -> Table:
    """Return the present state as a table with one row per robot; below it what a person should know.

    `problems` are those of the network connection; columns for which `width` has no room are left out.
    """
    table = Table(box=None, pad_edge=False, title_justify="left", title=headline(monitor, unix_s))
    rows = [_row(status, unix_s) for status in monitor.all]
    if len(monitor.arenas) < 2:
        for row in rows:
            row.pop("arena", None)
    names = columns_that_fit(rows, width)
    for name in names:
        table.add_column(name, justify="right" if name in _NUMBERS else "left", no_wrap=True)
    for row in rows:
        table.add_row(*(row.get(name, "") for name in names))
    lines = notices(monitor, unix_s, problems)
    table.caption, table.caption_justify = Text("\n".join(lines)), "left"
    return table


def columns_that_fit(rows: Sequence[Mapping[str, str | Text]], width: int) -> list[str]:
    """Return the columns of a table that are shown: the name and the energy at least, others while there is room.

    There is no column of arenas where no row says in which its body is.
    """
    order = [name for name in _ORDER if name != "arena" or any(name in row for row in rows)]
    widths = {name: cell_len(name) for name in order}
    for row in rows:
        for name, cell in row.items():
            widths[name] = max(widths[name], cell_len(str(cell)))
    for dropped in _DROPPED:
        if dropped in order and sum(widths[name] + _GAP for name in order) - _GAP > width:
            order.remove(dropped)
    return order


def headline(monitor: ColonyMonitor, unix_s: float) -> str:
    """Return a line with the number of robots that are alive, and the state of the arenas."""
    starting = sum(not s.is_alive and bool(s.doing(unix_s)) for s in monitor.robots.values())
    robots = f"{len(monitor.alive)} robots alive" + (f", {starting} starting" if starting else "")
    bodies = Counter(s.state.arena for s in monitor.alive if s.state is not None)
    arenas = [
        _format_arena(arena, bodies[name], unix_s) for name, arena in sorted(monitor.arenas.items())
    ]
    return f"{robots}   " + ("   ".join(arenas) or "no arena online")


def _format_arena(arena: ArenaStatus, bodies: int, unix_s: float) -> str:
    """Return the state of an arena; a bridge has bodies and no scene, for nobody sees its robots from above."""
    online = f"tick {arena.scene.tick}" if arena.scene else f"{bodies} bodies, no scene"
    return f"arena {arena.name}: " + (
        online if arena.is_alive else arena.doing(unix_s) or "offline"
    )


def _row(status: RobotStatus, unix_s: float) -> dict[str, str | Text]:
    """Return the cells of a robot by column; those of which nothing is known are missing."""
    state, name = status.state, status.robot.hex()[:8]
    doing = status.doing(unix_s)
    if not status.is_alive and doing:
        return {"robot": name, "": Text("starting", "cyan"), "module": doing}
    if state is None:
        presence = "alive" if status.is_alive else "offline"
        return {"robot": name, "": presence, "module": doing}
    age_s = unix_s - status.updated_s
    presence = "offline" if not status.is_alive else "silent" if age_s > SILENT_AFTER_S else "alive"
    style = {"offline": "dim red", "silent": "yellow", "alive": "green"}[presence]
    bar = "█" * round(8 * state.energy)
    return {
        "robot": f"{name} #{state.number}",
        "": Text.assemble(
            (presence, style), f" ({status.restarts} restarts)" if status.restarts else ""
        ),
        "arena": state.arena,
        "energy": f"{bar:░<8} {state.energy:.2f}",
        "module": _MODULES.get(state.module, "-") if state.arena else doing or "no body",
        "gen": str(state.generation),
        "matings": str(state.matings),
        "children": str(state.conceptions),
        "pool": str(state.pool),
        "doubt": f"{state.doubts}" + (f" ({state.orphaned} orphaned)" if state.orphaned else ""),
        "age": f"{age_s:.1f} s",
        "lost": str(status.missed + state.dropped),
    }


def plain_line(monitor: ColonyMonitor, unix_s: float, problems: Sequence[str] = ()) -> str:
    """Return the present state in one line: means, minima and sums over the robots, or what is awaited."""
    states = [status.state for status in monitor.alive if status.state is not None]
    notes = [*_activities(monitor, unix_s), *notices(monitor, unix_s, problems)]
    head = "   ".join([headline(monitor, unix_s), *notes])
    if not states:
        return head
    energy = sum(state.energy for state in states) / len(states)
    return (
        f"{head}   generation {min(state.generation for state in states)},"
        f" matings {sum(state.matings for state in states) / 2:g},"
        f" offspring {sum(state.conceptions for state in states)}, energy {energy:.2f}"
    )


def _activities(monitor: ColonyMonitor, unix_s: float) -> list[str]:
    """Return what robots without a body do, each activity once, with the progress published last."""
    latest: dict[str, str] = {}
    for status in sorted(monitor.robots.values(), key=lambda status: status.activity_s):
        if status.activity is not None and status.doing(unix_s):
            latest[status.activity.doing] = status.doing(unix_s)
    return sorted(latest.values())


def run_status(network: NetworkSettings, colony: str, seconds: float, as_json: bool) -> None:
    """Print the present state once; it waits for some seconds at most, until the state of every robot is known.

    Raises NetworkError where nobody answers.
    """
    with brief_session(network) as session:
        subscriber = TelemetrySubscriber(session, colony)
        problems = wait_for_states(session, subscriber, network, seconds)
        if as_json:
            print(json.dumps(as_dict(subscriber.monitor, time.time()), indent=2))
        else:
            console = plain_console()
            if not console.is_terminal:
                console.width = _TABLE_WIDTH
            console.print(table_of(subscriber.monitor, time.time(), problems, width=console.width))


def as_dict(monitor: ColonyMonitor, unix_s: float) -> dict[str, Any]:
    """Return the present state for `--json`."""
    return {
        "robots": [_robot_as_dict(status, unix_s) for status in monitor.all],
        "arenas": [
            {
                "name": name,
                "alive": arena.is_alive,
                "tick": arena.scene.tick if arena.scene else None,
                "doing": arena.doing(unix_s),
            }
            for name, arena in sorted(monitor.arenas.items())
        ],
    }


def _robot_as_dict(status: RobotStatus, unix_s: float) -> dict[str, Any]:
    state = status.state
    result: dict[str, Any] = {"id": status.robot.hex(), "colony": status.colony}
    result["alive"] = status.is_alive
    result["doing"] = status.doing(unix_s)
    if state is None:
        return result | dict.fromkeys(("energy", "generation", "matings"))
    fields = (
        "number", "arena", "incarnation", "tick", "generation", "agent", "energy", "matings",
        "conceptions", "captures", "pool", "waiting", "doubts", "orphaned", "peers", "refused", "dropped",
        "faults", "period_ms",
    )  # fmt: skip
    result |= {name: getattr(state, name) for name in fields}
    return result | {"age_s": round(unix_s - status.updated_s, 3), "missed": status.missed}
