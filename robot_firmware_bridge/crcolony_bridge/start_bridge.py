"""From options to the running process of a bridge."""

import contextlib
import secrets
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from crcolony.runtime.arena_key import arena_identity, format_arena_id
from crcolony.runtime.console import print_line
from crcolony.runtime.service_notify import ServiceNotifier
from crcolony.runtime.stop_server import StopServer
from crcolony.shutdown import ShutdownSignal
from crcolony.transport.inbox import Inbox
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.wait_for_network import open_connection
from crcolony.transport.zenoh_arena import ArenaTransport
from crcolony.transport.zenoh_relay import EnvelopeRelay
from crcolony.transport.zenoh_stop import StopAnswers
from crcolony_bridge.attached_bodies import AttachedBodies
from crcolony_bridge.attached_robot import AttachedRobot
from crcolony_bridge.bridge_process import BridgeProcess
from crcolony_bridge.calibrated_driver import CalibratedDriver
from crcolony_bridge.driver_registry import make_driver
from crcolony_bridge.errors import DeviceError


@dataclass(frozen=True)
class BridgeOptions:
    """What a bridge serves, and how."""

    robots: tuple[str, ...]
    """Each as DRIVER@ADDRESS"""
    name: str
    """The name of the arena for its robots"""
    period_s: float
    """The control period"""
    energy_per_charge: float
    """See `ChargeMeter`"""
    calibrations: Path
    """The folder with what was measured of each robot"""
    needs_watchdog: bool = True
    """Whether a robot is refused whose wheels turn on when this machine dies"""


def run_bridge(options: BridgeOptions, network: NetworkSettings, service: ServiceNotifier) -> None:
    """Serve attached robots until stopped. Raises DeviceError, and NetworkError, for what a person has to mend."""
    inbox = Inbox()
    stop = ShutdownSignal(wake=inbox.wake)
    name, period_s = options.name, options.period_s
    calibrations = options.calibrations
    identity = arena_identity(name, calibrations if calibrations.is_dir() else None)
    attached = [
        AttachedRobot(
            robot,
            CalibratedDriver(make_driver(robot), options.calibrations),
            print_line,
            needs_watchdog=options.needs_watchdog,
        )
        for robot in options.robots
    ]
    with contextlib.ExitStack() as opened:
        for robot in attached:
            opened.callback(robot.close)
            robot.open()
            _check_uid(robot, attached)
        waiting = open_connection(network, service.starting(stop), print_line)
        connection = opened.enter_context(waiting)
        if connection is None:
            return
        bridge_run = secrets.randbelow(2**62)
        bodies = AttachedBodies(
            attached, bridge_run, period_s, energy_per_charge=options.energy_per_charge
        )
        transport = ArenaTransport(connection.session, name, bridge_run, inbox.deliver)
        stopping = StopServer(attached, print_line)
        connection.add_user(transport)
        connection.add_user(StopAnswers(connection.session, name, stopping.answer))
        for robot in attached:
            robot.start()
        print_line(
            f"bridge {name} with {len(attached)} robots, {1.0 / period_s:.3g} periods a second"
        )
        print_line(format_arena_id(name, identity))
        relay = EnvelopeRelay(connection.session, inbox.deliver)
        connection.add_user(relay)
        process = BridgeProcess(
            bodies, name, identity, transport, relay, inbox, connection, print_line
        )
        service.say_ready(f"bridge {name} with {len(attached)} robots")
        process.run(service.watching(stop), period_s)
        print_line(bodies.refusals)
        print_line(f"stopped at tick {bodies.tick}")


def _check_uid(robot: AttachedRobot, attached: Sequence[AttachedRobot]) -> None:
    """Raise DeviceError for a robot that has the uid of another one."""
    described = robot.driver.description
    for other in attached:
        if other is robot or not (robot.is_connected and other.is_connected):
            continue
        if described.is_uid_unique and other.driver.description.uid == described.uid:
            raise DeviceError(f"{other.name} and {robot.name}: both have the uid {described.uid}")
