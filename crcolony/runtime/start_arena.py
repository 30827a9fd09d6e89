"""From options to the running process of an arena, or of a router."""

import secrets
from pathlib import Path
from typing import TYPE_CHECKING

from crcolony.config import Config, ConfigError
from crcolony.runtime.console import format_clock, print_line
from crcolony.shutdown import ShutdownSignal
from crcolony.storage.files import ARENA_CHECKPOINT, make_folder
from crcolony.transport.inbox import Inbox
from crcolony.transport.zenoh_arena import ArenaTransport
from crcolony.transport.zenoh_session import NetworkSettings, open_session

if TYPE_CHECKING:
    from crcolony.nodes.arena_node import ArenaNode


def run_arena(
    config: Config,
    name: str,
    network: NetworkSettings,
    wall_period_s: float | None,
    expect: int,
    folder: Path | None,
) -> None:
    """Run an arena until it is stopped; `wall_period_s` None is lockstep. Raises CrcolonyError for wrong input.

    The session is open before the world is imported and compiled, so that robots find each other meanwhile.
    """
    inbox = Inbox()
    stop = ShutdownSignal(wake=inbox.wake)
    arena_run = secrets.randbelow(2**62)
    with open_session(network) as session:
        from crcolony.runtime.arena_process import ArenaProcess
        from crcolony.runtime.networked_arena import NetworkedArena, restore_arena

        new_arena(config, 0, lockstep=False, expect=0).step()  # compiles before a clock runs
        node = new_arena(config, arena_run, wall_period_s is None, expect)
        checkpoint = None
        if folder is not None:
            make_folder(folder)
            checkpoint = folder / ARENA_CHECKPOINT
            if restore_arena(node, checkpoint):
                print_line(f"resumes at tick {node.tick}")
        transport = ArenaTransport(session, name, arena_run, inbox.deliver)
        arena = NetworkedArena(node, name, transport, checkpoint, print_line)
        process = ArenaProcess(arena, inbox)
        print_line(f"arena {name} with {config.robots} slots, {format_clock(wall_period_s)}")
        process.run(stop, wall_period_s)
        print_line(f"stopped at tick {node.tick}")


def new_arena(config: Config, arena_run: int, lockstep: bool, expect: int) -> "ArenaNode":
    """Return an arena; raises ConfigError if its settings are impossible."""
    from crcolony.nodes.arena_node import ArenaNode

    try:
        return ArenaNode(config, arena_run, lockstep, expect)
    except ValueError as error:
        raise ConfigError(str(error)) from None


def run_router(network: NetworkSettings) -> None:
    """Route the messages of clients until stopped. Routers hold no state: any of them can replace another."""
    inbox = Inbox()
    stop = ShutdownSignal(wake=inbox.wake)
    with open_session(network):
        print_line(f"router at {', '.join(network.listen)}")
        while not stop():
            inbox.get(1.0)
