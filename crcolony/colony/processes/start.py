"""From options to a running process: an arena, a robot, a router. What was opened is closed, whatever happens."""

import contextlib
import secrets
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from crcolony.colony.arena_node import ArenaNode
from crcolony.colony.identity import AllowList, Identity, create_key, load_key
from crcolony.colony.network import Network, open_session
from crcolony.colony.node import RobotNode
from crcolony.colony.processes.arena import ArenaProcess, restore_arena
from crcolony.colony.processes.robot import RobotProcess, in_words
from crcolony.colony.processes.stopping import Stop
from crcolony.colony.raising import numbered_streams, own_streams, raise_robots
from crcolony.colony.results import ResultsError
from crcolony.colony.store import Store
from crcolony.colony.telemetry import Event
from crcolony.colony.zenoh_transport import ArenaTransport, Inbox, RobotTransport
from crcolony.config import Config, ConfigError
from crcolony.world.body import OBSERVATION_WIDTH

MEMORY, KEY, WORLD = "memory.sqlite", "key", "arena.npz"
"""What the folders of robots and arenas hold."""


@dataclass(frozen=True)
class RobotOptions:
    """How one robot is run."""

    config: Config
    folder: Path
    colony: str
    arena: str
    network: Network
    key: Path | None = None
    """None: the folder's own, made if it is missing"""
    number: int = -1
    is_repeatable: bool = False
    allow: Path | None = None
    snapshot_s: float = 10.0


def run_robot(options: RobotOptions) -> None:
    """Run a robot until told to stop; raises Refusal for what is wrong outside, Broken when its disk fails."""
    inbox = Inbox()
    stop = Stop(wake=inbox.wake)
    make_folder(options.folder)
    key = options.key or options.folder / KEY
    identity = load_key(key) if key.exists() or options.key else create_key(key)
    allow = AllowList.load(options.allow) if options.allow else AllowList()
    config, number = options.config, max(options.number, 0)
    streams = (
        numbered_streams(config.seed, number, 1)
        if options.is_repeatable
        else own_streams([identity.id])
    )
    batch, _, (robot,) = raise_robots(config, [identity.id.hex()], streams)
    schema = bytes.fromhex(robot.subpopulation.schema.digest)
    warm_up(config)
    with contextlib.ExitStack() as opened:
        memory = Store(options.folder / MEMORY, identity.id, schema)
        opened.callback(memory.close)
        life = memory.begin_life(int(time.time()))
        session = open_session(options.network)
        transport = RobotTransport(session, options.colony, options.arena, inbox.deliver)
        opened.callback(transport.close)
        node = RobotNode(
            identity,
            options.colony,
            number,
            robot,
            batch,
            memory,
            life,
            transport,
            allow,
            hear=_say_events(identity),
        )
        say(f"robot {identity.id.hex()} of colony {options.colony}")
        process = RobotProcess(
            node,
            transport,
            inbox,
            config,
            options.colony,
            options.arena,
            options.number,
            options.snapshot_s,
            lambda: open_session(options.network),
            say,
        )
        process.run(stop)
        say(f"saved in generation {robot.generation}, after {node.matings} matings")


def run_arena(
    config: Config,
    name: str,
    network: Network,
    wall_period_s: float | None,
    expect: int,
    folder: Path | None,
) -> None:
    """Run an arena until told to stop; `wall_period_s` None is lockstep. Raises Refusal."""
    inbox = Inbox()
    stop = Stop(wake=inbox.wake)
    world = secrets.randbelow(2**62)
    node = new_arena(config, world, wall_period_s is None, expect)
    checkpoint = None
    if folder is not None:
        make_folder(folder)
        checkpoint = folder / WORLD
        if restore_arena(node, checkpoint):
            say(f"goes on from tick {node.tick}")
    with open_session(network) as session:
        transport = ArenaTransport(session, name, world, inbox.deliver)
        process = ArenaProcess(node, name, transport, inbox, wall_period_s, checkpoint, say)
        say(f"arena {name} with {config.robots} places, {_clock_in_words(wall_period_s)}")
        process.run(stop)
        say(f"stopped at tick {node.tick}")


def new_arena(config: Config, world: int, lockstep: bool, expect: int) -> ArenaNode:
    """Return an arena; raises ConfigError if its settings are impossible."""
    try:
        return ArenaNode(config, world, lockstep, expect)
    except ValueError as error:
        raise ConfigError(str(error)) from None


def run_router(network: Network) -> None:
    """Carry the messages of clients until told to stop: any number of routers stand in for each other."""
    inbox = Inbox()
    stop = Stop(wake=inbox.wake)
    with open_session(network):
        say(f"router at {', '.join(network.listen)}")
        while not stop():
            inbox.get(1.0)


def warm_up(config: Config) -> None:
    """Load the compiled control step before anybody counts on an answer."""
    _, _, (robot,) = raise_robots(config, ["0"], numbered_streams(0, 0, 1))
    robot.begin()
    robot.step(np.zeros(OBSERVATION_WIDTH))


def make_folder(folder: Path) -> None:
    """Make a folder; raises ResultsError if that is impossible."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ResultsError(f"{folder}: cannot be made: {error.strerror}") from None


def say(line: str) -> None:
    """Print a line at once."""
    print(line, flush=True)


def _say_events(identity: Identity) -> Callable[[Event], None]:
    def hear(event: Event) -> None:
        line = in_words(event)
        if line is not None:
            say(line)

    return hear


def _clock_in_words(wall_period_s: float | None) -> str:
    if wall_period_s is None:
        return "in lockstep"
    return f"{1.0 / wall_period_s:.3g} control periods a second"
