"""From options to the running process of a robot. Everything that is opened is closed, whatever happens.

A robot never imports the simulated world, which would take longer than all the rest of its start.
"""

import contextlib
import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from crcolony.body.contract import OBSERVATION_WIDTH
from crcolony.config import Config
from crcolony.nodes.node_inputs import ColonyMember, EmbodimentOptions, NodeResources
from crcolony.nodes.robot_node import RobotNode
from crcolony.protocol.identity import AllowList, create_key, load_key
from crcolony.robot.factory import make_robots, numbered_streams, own_streams
from crcolony.runtime.console import print_event, print_line
from crcolony.runtime.robot_process import RobotProcess
from crcolony.shutdown import ShutdownSignal
from crcolony.storage.files import KEY_FILE, ROBOT_FILE, make_folder
from crcolony.storage.store import RobotStore
from crcolony.transport.inbox import Inbox
from crcolony.transport.zenoh_robots import RobotTransport
from crcolony.transport.zenoh_session import NetworkSettings, open_session


@dataclass(frozen=True)
class RobotOptions:
    """How one robot is run. `number` is the arena slot that it requests; -1: any."""

    config: Config
    folder: Path
    colony: str
    arena: str
    network: NetworkSettings
    key: Path | None = None
    """None: the key in the folder, created if it is missing"""
    number: int = -1
    is_repeatable: bool = False
    """Whether its randomness is that of its number in a seeded colony, not its own"""
    allow: Path | None = None
    """File with the ids of the robots that it mates with; None: any"""
    snapshot_s: float = 10.0


def run_robot(options: RobotOptions) -> None:
    """Run a robot until it is stopped or done.

    Raises CrcolonyError for wrong input, and FatalStorageError when its disk fails.
    """
    inbox = Inbox()
    stop = ShutdownSignal(wake=inbox.wake)
    make_folder(options.folder)
    key = options.key or options.folder / KEY_FILE
    identity = load_key(key) if key.exists() or options.key else create_key(key)
    allow = AllowList.load(options.allow) if options.allow else AllowList()
    config, number = options.config, max(options.number, 0)
    streams = (
        numbered_streams(config.seed, number, 1)
        if options.is_repeatable
        else own_streams([identity.id])
    )
    batch, _, (robot,) = make_robots(config, [identity.id.hex()], streams)
    schema = bytes.fromhex(robot.subpopulation.schema.digest)
    warm_up(config)
    with contextlib.ExitStack() as opened:
        store = RobotStore(options.folder / ROBOT_FILE, identity.id, schema)
        opened.callback(store.close)
        incarnation = store.begin_incarnation(int(time.time()))
        session = open_session(options.network)
        transport = RobotTransport(session, options.colony, options.arena, inbox.deliver)
        opened.callback(transport.close)
        member = ColonyMember(identity, options.colony, number, incarnation)
        resources = NodeResources(
            store, transport, time.time, on_event=partial(print_event, identity.id)
        )
        node = RobotNode(member, robot, batch, resources, allow)
        print_line(f"robot {identity.id.hex()} of colony {options.colony}")
        process = RobotProcess(
            node,
            transport,
            inbox,
            EmbodimentOptions(config, options.arena, options.number, options.snapshot_s),
            lambda: open_session(options.network),
            print_line,
        )
        process.run(stop)
        print_line(f"saved in generation {robot.generation}, after {node.matings} matings")


def warm_up(config: Config) -> None:
    """Load the compiled control step before a clock runs."""
    _, _, (robot,) = make_robots(config, ["0"], numbered_streams(0, 0, 1))
    robot.start()
    robot.step(np.zeros(OBSERVATION_WIDTH))
