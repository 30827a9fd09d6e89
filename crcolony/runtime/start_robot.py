"""From options to a running process: an arena, a robot, a router. What was opened is closed, whatever happens.

A robot is simulated or not, and never needs the world: it is imported for an arena alone, since that takes longer than
all the rest of a robot's start.
"""

import contextlib
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from crcolony.body.contract import OBSERVATION_WIDTH
from crcolony.config import Config
from crcolony.nodes.robot_node import RobotNode
from crcolony.protocol.identity import AllowList, create_key, load_key
from crcolony.robot.factory import numbered_streams, own_streams, raise_robots
from crcolony.runtime.console import _say_event, say
from crcolony.runtime.robot_process import RobotProcess
from crcolony.shutdown import Stop
from crcolony.storage.files import KEY, MEMORY, make_folder
from crcolony.storage.store import Store
from crcolony.transport.inbox import Inbox
from crcolony.transport.zenoh_robots import RobotTransport
from crcolony.transport.zenoh_session import Network, open_session


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
            hear=_say_event,
        )
        say(f"robot {identity.id.hex()} of colony {options.colony}")
        process = RobotProcess(
            node,
            transport,
            inbox,
            config,
            options.arena,
            options.number,
            options.snapshot_s,
            lambda: open_session(options.network),
            say,
        )
        process.run(stop)
        say(f"saved in generation {robot.generation}, after {node.matings} matings")


def warm_up(config: Config) -> None:
    """Load the compiled control step before anybody counts on an answer."""
    _, _, (robot,) = raise_robots(config, ["0"], numbered_streams(0, 0, 1))
    robot.begin()
    robot.step(np.zeros(OBSERVATION_WIDTH))
