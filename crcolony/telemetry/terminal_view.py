"""Shows the state of a colony in the terminal: `crcolony top` and `crcolony status`."""

import json
import threading
import time
from typing import Any

from rich.console import Console
from rich.live import Live
from rich.table import Table
from rich.text import Text

from crcolony.protocol.telemetry_messages import SILENT_AFTER_S
from crcolony.shutdown import ShutdownSignal
from crcolony.telemetry.colony_monitor import ColonyMonitor
from crcolony.telemetry.robot_status import RobotStatus
from crcolony.telemetry.subscriber import TelemetrySubscriber
from crcolony.transport.zenoh_session import NetworkSettings, open_session

_REFRESH_S = 0.25
"""Between two updates of the table."""
_PLAIN_LINES_S = 5.0
"""Between two lines where the output is no terminal."""
_POLL_S = 0.05
"""Between two polls of `crcolony status`."""
_DISCOVERY_S = 0.7
"""So long `crcolony status` waits for further robots, at least."""
_TABLE_WIDTH = 110
"""Of a table where the output is no terminal."""


def run_top(network: NetworkSettings, colony: str, seconds: float | None) -> int:
    """Show the colony until Ctrl-C or for some seconds; where the output is no terminal, print a line every 5 s."""
    console = Console(markup=False, highlight=False)
    woken = threading.Event()
    stop = ShutdownSignal(seconds / 60.0 if seconds else None, wake=woken.set)
    with open_session(network) as session:
        subscriber = TelemetrySubscriber(session, colony)
        if console.is_terminal:
            with Live(console=console, refresh_per_second=4, screen=False) as live:
                while not stop():
                    subscriber.poll()
                    live.update(table_of(subscriber.monitor, time.time()))
                    woken.wait(_REFRESH_S)
        else:
            while not stop():
                woken.wait(min(_PLAIN_LINES_S, seconds or _PLAIN_LINES_S))
                subscriber.poll()
                console.print(plain_line(subscriber.monitor), soft_wrap=True)
    return 0


def table_of(monitor: ColonyMonitor, unix_s: float) -> Table:
    """Return the present state as a table with one row per robot."""
    table = Table(box=None, pad_edge=False, title_justify="left", title=headline(monitor))
    for name in ("robot", "", "energy", "module", "gen", "matings", "children", "pool", "doubt"):
        is_number = name in ("gen", "matings", "children", "pool", "doubt")
        table.add_column(name, justify="right" if is_number else "left", no_wrap=True)
    table.add_column("age", justify="right")
    table.add_column("lost", justify="right")
    if not monitor.robots:
        table.add_row("no robots yet; waiting …")
    for status in monitor.all:
        table.add_row(*_row(status, unix_s))
    return table


def headline(monitor: ColonyMonitor) -> str:
    """Return a line with the number of robots that are alive, and the state of the arenas."""
    arenas = [
        f"arena {name}: " + (f"tick {arena.scene.tick}" if arena.scene else "no scene yet")
        if arena.is_alive
        else f"arena {name}: offline"
        for name, arena in sorted(monitor.arenas.items())
    ]
    return f"{len(monitor.alive)} robots alive   " + ("   ".join(arenas) or "no arena online")


def _row(status: RobotStatus, unix_s: float) -> list[str | Text]:
    state, name = status.state, status.robot.hex()[:8]
    if state is None:
        return [name, "alive" if status.is_alive else "offline"]
    age_s = unix_s - status.updated_s
    presence = "offline" if not status.is_alive else "silent" if age_s > SILENT_AFTER_S else "alive"
    style = {"offline": "dim red", "silent": "yellow", "alive": "green"}[presence]
    bar = "█" * round(8 * state.energy)
    return [
        f"{name} #{state.number}",
        Text.assemble(
            (presence, style), f" ({status.restarts} restarts)" if status.restarts else ""
        ),
        f"{bar:░<8} {state.energy:.2f}",
        {0: "foraging", 1: "mating"}.get(state.module, "-") if state.arena else "no body",
        str(state.generation),
        str(state.matings),
        str(state.conceptions),
        str(state.pool),
        f"{state.doubts}" + (f" ({state.orphaned} orphaned)" if state.orphaned else ""),
        f"{age_s:.1f} s",
        str(status.missed + state.dropped),
    ]


def plain_line(monitor: ColonyMonitor) -> str:
    """Return the present state in one line: means, minima and sums over the robots."""
    states = [status.state for status in monitor.alive if status.state is not None]
    if not states:
        return headline(monitor).strip()
    energy = sum(state.energy for state in states) / len(states)
    return (
        f"{headline(monitor)}   generation {min(state.generation for state in states)},"
        f" matings {sum(state.matings for state in states) / 2:g},"
        f" offspring {sum(state.conceptions for state in states)}, energy {energy:.2f}"
    )


def run_status(network: NetworkSettings, colony: str, seconds: float, as_json: bool) -> None:
    """Print the present state once; it waits for some seconds at most, until the state of every robot is known."""
    with open_session(network) as session:
        subscriber = TelemetrySubscriber(session, colony)
        end_s = time.monotonic() + seconds
        settled_s = time.monotonic() + min(seconds, _DISCOVERY_S)
        pause = threading.Event()
        while time.monotonic() < end_s:
            pause.wait(_POLL_S)
            subscriber.poll()
            robots = subscriber.monitor.alive
            is_complete = bool(robots) and all(status.state for status in robots)
            if is_complete and time.monotonic() > settled_s:
                break
        subscriber.poll()
        if as_json:
            print(json.dumps(as_dict(subscriber.monitor, time.time()), indent=2))
        else:
            console = Console(markup=False, highlight=False)
            console.width = max(console.width, _TABLE_WIDTH)
            console.print(table_of(subscriber.monitor, time.time()))


def as_dict(monitor: ColonyMonitor, unix_s: float) -> dict[str, Any]:
    """Return the present state for `--json`."""
    return {
        "robots": [_robot_as_dict(status, unix_s) for status in monitor.all],
        "arenas": [
            {
                "name": name,
                "alive": arena.is_alive,
                "tick": arena.scene.tick if arena.scene else None,
            }
            for name, arena in sorted(monitor.arenas.items())
        ],
    }


def _robot_as_dict(status: RobotStatus, unix_s: float) -> dict[str, Any]:
    state = status.state
    result: dict[str, Any] = {"id": status.robot.hex(), "colony": status.colony}
    result["alive"] = status.is_alive
    if state is None:
        return result | dict.fromkeys(("energy", "generation", "matings"))
    fields = (
        "number", "arena", "incarnation", "tick", "generation", "agent", "energy", "matings",
        "conceptions", "captures", "pool", "waiting", "doubts", "orphaned", "peers", "refused", "dropped",
        "faults", "period_ms",
    )  # fmt: skip
    result |= {name: getattr(state, name) for name in fields}
    return result | {"age_s": round(unix_s - status.updated_s, 3), "missed": status.missed}
