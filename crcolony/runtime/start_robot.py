"""From options to the running process of a robot. Everything that is opened is closed, whatever happens.

A robot never imports the simulated world, which would take longer than all the rest of its start.
"""

import contextlib
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from crcolony.config import Config
from crcolony.evolution.founders import Founders
from crcolony.nodes.node_inputs import ColonyMember, EmbodimentOptions, NodeResources
from crcolony.nodes.robot_node import RobotNode
from crcolony.protocol.identity import (
    AllowList,
    Identity,
    RobotId,
    create_key,
    key_warning,
    load_key,
)
from crcolony.protocol.signed_telemetry import purpose_of_robot, sign_telemetry
from crcolony.results.colony_folder import begin_robot_folder
from crcolony.robot.factory import make_robots, numbered_streams, own_streams
from crcolony.robot.genes import agent_schema
from crcolony.runtime.console import name_process, print_event, print_line, print_warning
from crcolony.runtime.robot_process import RobotProcess
from crcolony.runtime.service_notify import ServiceNotifier
from crcolony.runtime.startup_report import StartupReport
from crcolony.runtime.warm_up import warm_up
from crcolony.shutdown import ShutdownSignal
from crcolony.storage.claimed_folder import check_folder
from crcolony.storage.files import (
    KEY_FILE,
    KNOWN_ARENAS_FILE,
    ROBOT_FILE,
    FolderError,
    make_folder,
)
from crcolony.storage.folder_record import read_record
from crcolony.storage.founders_file import FOUNDERS_FILE, Beginning, read_founders
from crcolony.storage.known_arenas import KnownArenasFile
from crcolony.storage.store import RobotStore
from crcolony.transport.inbox import Inbox
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.wait_for_network import open_connection
from crcolony.transport.zenoh_robots import RobotTransport
from crcolony.transport.zenoh_session import declared_as_observer


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
    beginning: Beginning | None = None
    """The earlier run with whose robots it begins; None: what is in its folder, or random genotypes"""


def run_robot(options: RobotOptions, service: ServiceNotifier) -> None:
    """Run a robot until it is stopped or done.

    Raises CrcolonyError for wrong input, and FatalStorageError when its disk fails.
    """
    inbox = Inbox()
    stop = ShutdownSignal(wake=inbox.wake)
    make_folder(options.folder)
    check_folder(options.folder, "robot")
    key = options.key or options.folder / KEY_FILE
    identity = load_key(key) if key.exists() or options.key else create_key(key)
    name_process(robot=identity.id.hex())
    if warning := key_warning(key):
        print_warning(warning)
    allow = AllowList.load(options.allow) if options.allow else AllowList()
    known_arenas = KnownArenasFile(options.folder / KNOWN_ARENAS_FILE)
    config, number = options.config, max(options.number, 0)
    streams = (
        numbered_streams(config.seed, number, 1)
        if options.is_repeatable
        else own_streams([identity.id])
    )
    founders = _founders_of(options, identity.id)
    batch, parameters, (robot,) = make_robots(config, [identity.id.hex()], streams, founders)
    schema = bytes.fromhex(robot.subpopulation.schema.digest)
    with contextlib.ExitStack() as opened:
        connection = opened.enter_context(
            open_connection(options.network, service.starting(stop), print_line)
        )
        if connection is None:
            return
        session = connection.session
        transport = RobotTransport(session, options.colony, options.arena, inbox.deliver)
        connection.add_user(transport)
        publish = _signed_activity(transport, identity, options.colony)
        report = StartupReport(publish, service.reporting(print_line))
        with declared_as_observer(session), report, stop.interruptible():
            warm_up(batch, parameters, report)
        if stop():
            return
        store = RobotStore(options.folder / ROBOT_FILE, identity.id, schema)
        opened.callback(store.close)
        incarnation = store.begin_incarnation(int(time.time()))
        member = ColonyMember(identity, options.colony, number, incarnation)
        resources = NodeResources(
            store, transport, time.time, on_event=partial(print_event, identity.id)
        )
        node = RobotNode(member, robot, batch, resources, allow)
        print_line(f"robot {identity.id.hex()} of colony {options.colony}")
        embodiment = EmbodimentOptions(
            config, options.arena, options.number, known_arenas, snapshot_s=options.snapshot_s
        )
        process = RobotProcess(node, transport, inbox, embodiment, connection, print_line)
        service.say_ready(f"robot {identity.id.hex()}")
        process.run(service.watching(stop))
        print_line(f"saved in generation {robot.generation}, after {node.matings} matings")


def _signed_activity(
    transport: RobotTransport, identity: Identity, colony: str
) -> Callable[[bytes], None]:
    """Return a function that signs and publishes what a robot does before it has a node."""
    purpose = purpose_of_robot(colony)

    def publish(activity: bytes) -> None:
        signed = sign_telemetry(activity, purpose, identity)
        transport.publish_telemetry(identity.id, "activity", signed)

    return publish


def _founders_of(options: RobotOptions, robot: RobotId) -> Founders | None:
    """Return what the robot begins with, which is in its folder from its first start on; None: random genotypes.

    A robot without a number takes the share of one by its id. Raises FolderError.
    """
    folder, config = options.folder, options.config
    record = read_record(folder)
    if record is None or record.origin is None:
        if options.beginning is None:
            return None
        number = options.number if options.number >= 0 else int.from_bytes(robot)
        begin_robot_folder(folder, options.beginning.share_of(number), config)
    founders = read_founders(folder)
    if founders.schema != agent_schema(config.learning, config.heredity).digest:
        raise FolderError(f"{folder / FOUNDERS_FILE}: of other genes than those of the settings")
    return founders
