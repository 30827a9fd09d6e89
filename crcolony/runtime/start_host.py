"""From options to the running process of a host. Everything that is opened is closed, whatever happens."""

import contextlib
import secrets
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from crcolony.body import contract
from crcolony.compile_progress import compile_progress
from crcolony.config import Config
from crcolony.nodes.event_buffer import MAX_BYTES
from crcolony.nodes.node_inputs import ColonyMember, NodeResources
from crcolony.nodes.reported_settings import settings_of_robot
from crcolony.nodes.robot_node import RobotNode
from crcolony.protocol.identity import Identity, create_key, key_warning, load_key
from crcolony.results.colony_folder import ColonyFolder
from crcolony.results.run_report import print_run_report
from crcolony.robot.factory import make_robots, own_streams
from crcolony.robot.robot import Robot
from crcolony.robot.state import Robots
from crcolony.robot.step import step_robots
from crcolony.runtime.arena_key import arena_identity
from crcolony.runtime.console import print_line, print_warning
from crcolony.runtime.host_process import HostProcess
from crcolony.runtime.hosted_robots import HostedRobots
from crcolony.runtime.networked_arena import NetworkedArena, restore_arena
from crcolony.runtime.service_notify import ServiceNotifier
from crcolony.runtime.simulated_bodies import SimulatedBodies
from crcolony.runtime.start_arena import compile_world, new_arena, starting_arena
from crcolony.runtime.startup_report import StartupReport
from crcolony.runtime.stop_server import StopServer
from crcolony.runtime.warm_up import COMPILING_STEP
from crcolony.shutdown import ShutdownSignal
from crcolony.storage.files import ARENA_CHECKPOINT, KEY_FILE, ROBOT_FILE
from crcolony.storage.store import RobotStore
from crcolony.terminal import plain_console
from crcolony.transport.inbox import Inbox
from crcolony.transport.interface import Transport
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.wait_for_network import open_connection
from crcolony.transport.zenoh_arena import ArenaTransport
from crcolony.transport.zenoh_robots import RobotTransport
from crcolony.transport.zenoh_stop import StopAnswers

_HISTORY_BYTES = 32 * 2**20
"""Of the recent events that all robots of the process keep for observers."""


@dataclass(frozen=True)
class HostOptions:
    """How a host is run. `wall_period_s` None: as fast as possible; `minutes` None: until it is stopped."""

    config: Config
    count: int
    """Robots in this process"""
    colony: str
    arena: str
    network: NetworkSettings
    wall_period_s: float | None
    minutes: float | None
    has_plots: bool = True
    """Whether to draw figures at the end"""


def run_host(options: HostOptions, opened_folder: ColonyFolder, service: ServiceNotifier) -> None:
    """Run an arena with robots in this process until it is stopped.

    Raises CrcolonyError for wrong input, and FatalStorageError when a disk fails.
    """
    config, folder = options.config, opened_folder.path
    inbox = Inbox()
    arena_run = secrets.randbelow(2**62)
    arena = new_arena(config, arena_run, lockstep=False, expect=0)
    key = arena_identity(options.arena, folder)
    folders = [opened_folder.prepare_robot(number) for number in range(options.count)]
    identities = [_load_identity(robot_folder) for robot_folder in folders]
    if warning := key_warning(folders[0] / KEY_FILE):
        print_warning(warning)
    ids = [identity.id for identity in identities]
    batch, parameters, robots = make_robots(
        config, [one.hex() for one in ids], own_streams(ids), opened_folder.founders
    )
    restore_arena(arena, folder / ARENA_CHECKPOINT)
    stop = ShutdownSignal(wake=inbox.wake)
    with contextlib.ExitStack() as opened:
        connection = opened.enter_context(
            open_connection(options.network, service.starting(stop), print_line)
        )
        if connection is None:
            return
        session = connection.session
        starting = starting_arena(session, options.arena, key, service.reporting(print_line))
        with starting as report, stop.interruptible():
            compile_world(config, report)
            _compile_step(config, ids[0], report)
        if stop():
            return
        robot_transport = RobotTransport(session, options.colony, options.arena, inbox.deliver)
        nodes = []
        for number, (identity, robot) in enumerate(zip(identities, robots, strict=True)):
            store = _open_store(folders[number], identity, robot)
            opened.callback(store.close)
            resources = _resources(store, robot_transport, options.count)
            nodes.append(_new_node(identity, options.colony, number, robot, batch, resources))
        transport = ArenaTransport(session, options.arena, arena_run, inbox.deliver)
        checkpoint = folder / ARENA_CHECKPOINT
        networked = NetworkedArena(arena, options.arena, key, transport, checkpoint, print_line)
        hosted = HostedRobots(nodes, batch, parameters, robot_transport)
        process = HostProcess(networked, hosted, inbox, connection, print_line)
        process.start(settings_of_robot(config, config.body))
        status = f"{options.count} robots of colony {options.colony} in arena {options.arena}"
        print_line(f"{status}, and {config.robots - options.count} slots for others")
        stops = StopServer([SimulatedBodies(arena)], print_line)
        connection.add_user(robot_transport)
        connection.add_user(transport)
        connection.add_user(StopAnswers(session, options.arena, stops.answer))
        stop.end_after(options.minutes)
        service.say_ready(status)
        try:
            process.run(service.watching(stop), options.wall_period_s)
        finally:
            process.stop()
    print_run_report(plain_console(), folder, config, stop, has_plots=options.has_plots)


def _load_identity(folder: Path) -> Identity:
    """Return the identity of a robot's folder; create the key if it is missing."""
    key = folder / KEY_FILE
    return load_key(key) if key.exists() else create_key(key)


def _open_store(folder: Path, identity: Identity, robot: Robot) -> RobotStore:
    schema = bytes.fromhex(robot.subpopulation.schema.digest)
    return RobotStore(folder / ROBOT_FILE, identity.id, schema)


def _resources(store: RobotStore, transport: Transport, robots: int) -> NodeResources:
    """Return what one of so many robots of the process uses of it."""
    history_bytes = min(MAX_BYTES, _HISTORY_BYTES // robots)
    return NodeResources(store, transport, time.time, history_bytes=history_bytes)


def _new_node(
    identity: Identity,
    colony: str,
    number: int,
    robot: Robot,
    batch: Robots,
    resources: NodeResources,
) -> RobotNode:
    incarnation = resources.store.begin_incarnation(int(time.time()))
    member = ColonyMember(identity, colony, number, incarnation)
    return RobotNode(member, robot, batch, resources)


def _compile_step(config: Config, robot: bytes, report: StartupReport) -> None:
    """Compile the step of a batch before a clock runs."""
    with compile_progress(report.counting(COMPILING_STEP), step_robots):
        step_robots(
            *make_robots(config, ["0"], own_streams([robot]))[:2],
            np.zeros((1, contract.OBSERVATION_WIDTH)),
            np.zeros((1, contract.ACTION_WIDTH)),
        )
