"""What a colony looks like from outside, in the terminal, straight from Zenoh: `crcolony top` and `crcolony status`."""

import json
import threading
import time
from typing import Any

import zenoh
from rich.console import Console
from rich.live import Live
from rich.table import Table
from zenoh.handlers import Callback

from crcolony.colony import keys
from crcolony.colony.keys import ColonyKeys
from crcolony.colony.network import Network, open_session
from crcolony.colony.stopping import Stop
from crcolony.colony.telemetry import STALE_S
from crcolony.colony.watch import Watch, Watched

_REFRESH_S = 0.25
_PLAIN_LINES_S = 5.0
_TABLE_WIDTH = 110
"""Of a table that is not for a terminal"""


class Watcher:
    """A `Watch` that is fed from the network; `lock` guards it, since Zenoh calls from its own threads."""

    def __init__(self, session: zenoh.Session, colony: str = "*") -> None:
        self.watch = Watch()
        self.lock = threading.Lock()
        of = ColonyKeys(colony)
        live = session.liveliness()
        self._entities: list[Any] = [
            live.declare_token(keys.observer(str(session.zid()))),
            session.declare_subscriber(of.all_states, self._listen(self._on_state)),
            session.declare_subscriber(of.all_events, self._listen(self._on_event)),
            session.declare_subscriber(f"{keys.ROOT}/arena/*/scene", self._listen(self._on_scene)),
            live.declare_subscriber(of.all_alive, self._listen(self._on_token), history=True),
            live.declare_subscriber(
                keys.ALL_ARENAS_ALIVE, self._listen(self._on_token), history=True
            ),
        ]

    def _listen(self, take: Any) -> Any:
        def locked(sample: zenoh.Sample) -> None:
            with self.lock:
                take(sample)

        return Callback(locked, indirect=False)

    def _on_token(self, sample: zenoh.Sample) -> None:
        self.watch.token(str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT)

    def _on_state(self, sample: zenoh.Sample) -> None:
        self.watch.told_state(str(sample.key_expr), sample.payload.to_bytes(), time.monotonic())

    def _on_event(self, sample: zenoh.Sample) -> None:
        self.watch.told_event(sample.payload.to_bytes())

    def _on_scene(self, sample: zenoh.Sample) -> None:
        self.watch.told_scene(sample.payload.to_bytes())


def run_top(network: Network, colony: str, seconds: float | None) -> int:
    """Show the colony until Ctrl-C; without a terminal, plain lines now and then."""
    console = Console()
    woken = threading.Event()
    stop = Stop(seconds / 60.0 if seconds else None, wake=woken.set)
    with open_session(network) as session:
        watcher = Watcher(session, colony)
        if console.is_terminal:
            with Live(console=console, refresh_per_second=4, screen=False) as live:
                while not stop():
                    live.update(shown(watcher))
                    woken.wait(_REFRESH_S)
        else:
            while not stop():
                woken.wait(min(_PLAIN_LINES_S, seconds or _PLAIN_LINES_S))
                with watcher.lock:
                    console.print(plain_line(watcher.watch), highlight=False, soft_wrap=True)
    return 0


def shown(watcher: Watcher) -> Table:
    """Return the present state as a table."""
    with watcher.lock:
        return table_of(watcher.watch, time.monotonic())


def table_of(watch: Watch, now_s: float) -> Table:
    """Return a table with a row for each robot."""
    table = Table(box=None, pad_edge=False, title_justify="left", title=headline(watch))
    for name in ("robot", "", "energy", "module", "gen", "matings", "children", "pool", "doubt"):
        is_number = name in ("gen", "matings", "children", "pool", "doubt")
        table.add_column(name, justify="right" if is_number else "left", no_wrap=True)
    table.add_column("age", justify="right")
    table.add_column("lost", justify="right")
    if not watch.robots:
        table.add_row("no robots yet; looking …")
    for watched in watch.all:
        table.add_row(*_row(watched, now_s))
    return table


def headline(watch: Watch) -> str:
    """Say how many robots are alive, and what the arenas do."""
    arenas = [
        f"arena {name}: " + (f"tick {watch.scenes[name].tick}" if name in watch.scenes else "quiet")
        if sessions
        else f"arena {name}: gone"
        for name, sessions in sorted(watch.arenas.items())
    ]
    return f"{len(watch.alive)} robots alive   " + ("   ".join(arenas) or "no arena in sight")


def _row(watched: Watched, now_s: float) -> list[str]:
    state, name = watched.state, watched.robot.hex()[:8]
    if state is None:
        return [name, "alive" if watched.is_alive else "gone"]
    age_s = now_s - watched.heard_s
    how = "gone" if not watched.is_alive else "silent" if age_s > STALE_S else "alive"
    style = {"gone": "[dim red]", "silent": "[yellow]", "alive": "[green]"}[how]
    bar = "█" * round(8 * state.energy)
    return [
        f"{name} #{state.number}",
        f"{style}{how}[/]" + (f" ({watched.restarts} restarts)" if watched.restarts else ""),
        f"{bar:░<8} {state.energy:.2f}",
        {0: "foraging", 1: "mating"}.get(state.module, "-") if state.arena else "no body",
        str(state.generation),
        str(state.matings),
        str(state.conceptions),
        str(state.pool),
        f"{state.doubts}" + (f" ({state.orphaned} orphaned)" if state.orphaned else ""),
        f"{age_s:.1f} s",
        str(watched.missed + state.dropped),
    ]


def plain_line(watch: Watch) -> str:
    """Say the same in one line."""
    states = [watched.state for watched in watch.alive if watched.state is not None]
    if not states:
        return headline(watch).strip()
    energy = sum(state.energy for state in states) / len(states)
    return (
        f"{headline(watch)}   generation {min(state.generation for state in states)},"
        f" matings {sum(state.matings for state in states) / 2:g},"
        f" offspring {sum(state.conceptions for state in states)}, energy {energy:.2f}"
    )


def run_status(network: Network, colony: str, seconds: float, as_json: bool) -> None:
    """Listen for a while, then say who is alive and how they are."""
    with open_session(network) as session:
        watcher = Watcher(session, colony)
        end_s = time.monotonic() + seconds
        settled_s = time.monotonic() + min(seconds, 0.7)
        pause = threading.Event()
        while time.monotonic() < end_s:
            pause.wait(0.05)
            with watcher.lock:
                known = watcher.watch.alive
                is_known = bool(known) and all(watched.state for watched in known)
            if is_known and time.monotonic() > settled_s:
                break
        with watcher.lock:
            if as_json:
                print(json.dumps(as_dict(watcher.watch, time.monotonic()), indent=2))
            else:
                console = Console()
                console.width = max(console.width, _TABLE_WIDTH)
                console.print(table_of(watcher.watch, time.monotonic()))


def as_dict(watch: Watch, now_s: float) -> dict[str, Any]:
    """Return what is known, for programs."""
    return {
        "robots": [_robot_as_dict(watched, now_s) for watched in watch.all],
        "arenas": [
            {
                "name": name,
                "alive": bool(sessions),
                "tick": watch.scenes[name].tick if name in watch.scenes else None,
            }
            for name, sessions in sorted(watch.arenas.items())
        ],
    }


def _robot_as_dict(watched: Watched, now_s: float) -> dict[str, Any]:
    state = watched.state
    told: dict[str, Any] = {"id": watched.robot.hex(), "colony": watched.colony}
    told["alive"] = watched.is_alive
    if state is None:
        return told | dict.fromkeys(("energy", "generation", "matings"))
    fields = (
        "number", "arena", "life", "tick", "generation", "agent", "energy", "matings",
        "conceptions", "pool", "waiting", "doubts", "orphaned", "peers", "refused", "dropped",
        "faults", "period_ms",
    )  # fmt: skip
    told |= {name: getattr(state, name) for name in fields}
    return told | {"age_s": round(now_s - watched.heard_s, 3), "missed": watched.missed}
