"""From options to the running process of an arena, or of a router."""

import contextlib
import secrets
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from crcolony.config import Config, ConfigError
from crcolony.protocol.identity import Identity
from crcolony.runtime.arena_key import arena_identity, format_arena_id
from crcolony.runtime.console import format_clock, print_line
from crcolony.runtime.service_notify import ServiceNotifier
from crcolony.runtime.startup_report import Progress, StartupReport
from crcolony.runtime.stop_server import StopServer
from crcolony.shutdown import ShutdownSignal
from crcolony.storage.claimed_folder import ClaimedFolder, claim_folder
from crcolony.storage.files import ARENA_CHECKPOINT, FolderError
from crcolony.storage.folder_record import read_record
from crcolony.transport.inbox import Inbox
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.open_files import allow_open_files
from crcolony.transport.panic_watch import PanicWatch
from crcolony.transport.wait_for_network import open_connection
from crcolony.transport.zenoh_arena import ArenaTransport, activity_of_arena
from crcolony.transport.zenoh_session import Session, declared_as_observer
from crcolony.transport.zenoh_stop import StopAnswers

if TYPE_CHECKING:
    from crcolony.nodes.arena_node import ArenaNode

_ROUTER_PERIOD_S = 0.25
"""How often a router looks at what is due; messages pass through it without its loop."""


def run_arena(
    config: Config,
    name: str,
    network: NetworkSettings,
    wall_period_s: float | None,
    expect: int,
    folder: Path | None,
    service: ServiceNotifier,
) -> None:
    """Run an arena until it is stopped; `wall_period_s` None is lockstep. Raises CrcolonyError for wrong input.

    The session is open before the world is imported and compiled, so that robots find each other meanwhile.
    """
    allow_open_files(config.robots)
    inbox = Inbox()
    stop = ShutdownSignal(wake=inbox.wake)
    arena_run = secrets.randbelow(2**62)
    waiting = open_connection(network, service.starting(stop), print_line)
    with _claimed(folder) as claimed, waiting as connection:
        if connection is None:
            return
        from crcolony.runtime.arena_process import ArenaProcess
        from crcolony.runtime.networked_arena import NetworkedArena, restore_arena
        from crcolony.runtime.simulated_bodies import SimulatedBodies

        new_arena(config, arena_run, wall_period_s is None, expect)  # refuses wrong settings
        identity = arena_identity(name, folder)
        starting = starting_arena(connection.session, name, identity, service.reporting(print_line))
        with starting as report, stop.interruptible():
            compile_world(config, report)
        if stop():
            return
        node = new_arena(config, arena_run, wall_period_s is None, expect)
        checkpoint = None
        if folder is not None:
            checkpoint = folder / ARENA_CHECKPOINT
            if restore_arena(node, checkpoint):
                print_line(f"resumes at tick {node.tick}")
        transport = ArenaTransport(connection.session, name, arena_run, inbox.deliver)
        arena = NetworkedArena(node, name, identity, transport, checkpoint, print_line)
        if claimed is not None and claimed.is_new:
            arena.save()
            claimed.begin()
        stops = StopServer([SimulatedBodies(node)], print_line)
        connection.add_user(transport)
        connection.add_user(StopAnswers(connection.session, name, stops.answer))
        process = ArenaProcess(arena, inbox, connection)
        print_line(f"arena {name} with {config.robots} slots, {format_clock(wall_period_s)}")
        print_line(format_arena_id(name, identity))
        service.say_ready(f"arena {name}")
        process.run(service.watching(stop), wall_period_s)
        print_line(node.refusals)
        print_line(f"stopped at tick {node.tick}")


@contextlib.contextmanager
def _claimed(folder: Path | None) -> Iterator[ClaimedFolder | None]:
    """Claim the folder of an arena, if it has one.

    Raises FolderError for the folder of something else, or one whose checkpoint is missing.
    """
    if folder is None:
        yield None
        return
    claimed, checkpoint = claim_folder(folder, "arena"), folder / ARENA_CHECKPOINT
    try:
        if read_record(folder) is not None and not checkpoint.exists():
            raise FolderError(f"{checkpoint}: missing; delete {folder} to start another arena")
        yield claimed
    finally:
        claimed.close()


def new_arena(config: Config, arena_run: int, lockstep: bool, expect: int) -> "ArenaNode":
    """Return an arena; raises ConfigError if its settings are impossible."""
    from crcolony.nodes.arena_node import ArenaNode

    try:
        return ArenaNode(config, arena_run, lockstep, expect)
    except ValueError as error:
        raise ConfigError(str(error)) from None


@contextlib.contextmanager
def starting_arena(
    session: Session, name: str, identity: Identity, print_line: Callable[[str], None]
) -> Iterator[StartupReport]:
    """Report inside the context what a process does before its arena is online."""
    publish = activity_of_arena(session, name, identity)
    with declared_as_observer(session), StartupReport(publish, print_line) as report:
        report.follow(lambda: Progress("starting"))
        yield report


def compile_world(config: Config, report: StartupReport) -> None:
    """Compile the simulated world before a clock runs."""
    from crcolony.compile_progress import compile_progress
    from crcolony.world.tick import step_world

    with compile_progress(report.counting("compiling the world"), step_world):
        new_arena(config, 0, lockstep=False, expect=0).step()


def run_router(network: NetworkSettings, service: ServiceNotifier) -> None:
    """Route the messages of clients until stopped. Routers hold no state: any of them can replace another."""
    inbox = Inbox()
    stop = ShutdownSignal(wake=inbox.wake)
    waiting = open_connection(network, service.starting(stop), print_line)
    with PanicWatch() as panics, waiting as connection:
        if connection is None:
            return
        print_line(f"router at {', '.join(network.listen)}")
        service.say_ready("router")
        is_stopped = service.watching(stop)
        while not is_stopped():
            inbox.get(_ROUTER_PERIOD_S)
            now_s = time.monotonic()
            if panics.take():
                print_line("a thread of Zenoh has panicked; opening another session")
                connection.renew_by(now_s)
            connection.handle_timers(now_s)
