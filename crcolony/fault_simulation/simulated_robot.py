"""The process of one robot in virtual time, in place of `runtime.robot_process`: it may crash at any operation.

A crash loses everything but the robot's file, from which the next incarnation starts, as a real process does.
"""

import math
import traceback
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from random import Random

from crcolony.config import Config
from crcolony.errors import FatalStorageError
from crcolony.fault_simulation.faults import CrashCountdown, CrashError, Faults
from crcolony.fault_simulation.invariants import InvariantChecker
from crcolony.fault_simulation.simulated_network import (
    Schedule,
    SimulatedNetwork,
    SimulatedTransport,
)
from crcolony.fault_simulation.simulated_store import Disk, SimulatedStore
from crcolony.nodes.embodied_robot import EmbodiedRobot
from crcolony.nodes.node_inputs import (
    ColonyMember,
    EmbodimentOptions,
    FirstArenas,
    NodeResources,
    ProcessCallbacks,
)
from crcolony.nodes.robot_node import RobotNode
from crcolony.protocol.body_messages import Contact
from crcolony.protocol.encounters import MatingLimits
from crcolony.protocol.identity import Identity
from crcolony.robot.factory import make_robots, numbered_streams
from crcolony.storage.store import StorageFullError
from crcolony.transport.interface import InboundEvent, RobotOffline, RobotOnline, Transport

COLONY = "simulated"
_START_UNIX_S = 1_800_000_000.0
"""Time of day when a simulation starts."""
_SNAPSHOT_S = 8.0
_STATE_PERIOD_S = 2.5
_MAX_QUEUED = 64
"""Inbound events kept for a process that is paused; the network drops the rest."""
_MAX_SILENCE_S = 1.0
"""A robot without an observation for longer than this does not operate."""


@dataclass(frozen=True)
class SharedContext:
    """What all robots of a simulated colony share."""

    config: Config
    limits: MatingLimits
    faults: Faults
    folder: Path
    schedule: Schedule
    network: SimulatedNetwork
    checker: InvariantChecker
    rng: Random


class _CheckedNode(RobotNode):
    """A robot whose contacts are reported to the checker."""

    checker: InvariantChecker

    def handle_step_events(self, now_s: float, tick: int, contact: Contact | None) -> None:
        """Report the contact, and handle the events of a control step."""
        if contact is not None:
            self.checker.on_contact(self.id, contact)
        super().handle_step_events(now_s, tick, contact)


class SimulatedRobot:
    """A robot, one incarnation after another."""

    def __init__(self, number: int, identity: Identity, context: SharedContext) -> None:
        self.id, self.number, self.context = identity.id, number, context
        self.robot: EmbodiedRobot | None = None
        self.is_paused = False
        self.clock_error_s = 0.0
        self._identity = identity
        self._known_arenas = FirstArenas()
        self._store: SimulatedStore | None = None
        self._countdown = CrashCountdown(context.rng, 0.0)
        self.disk = Disk(context.rng, context.faults.broken_disks)
        self._inbox: deque[InboundEvent] = deque()
        self._timer_s = math.inf
        self._starts = self._sessions = 0

    # Incarnations ----------------------------------------------------------------------------------------------

    def start(self) -> None:
        """Start an incarnation from the disk, unless one is running."""
        if self._store is None:
            self._starts += 1
            self._run_guarded(self._start)

    def _start(self) -> None:
        context = self.context
        is_fault_free = context.network.is_fault_free
        operations = 0.0 if is_fault_free else context.faults.crash_operations
        self._countdown = CrashCountdown(context.rng, operations)
        transport = SimulatedTransport(
            context.network, self.id, self._countdown.count, self._on_published
        )
        options = EmbodimentOptions(
            context.config,
            "arena",
            self.number,
            self._known_arenas,
            context.rng.randbytes,
            _SNAPSHOT_S,
            _STATE_PERIOD_S,
        )
        callbacks = ProcessCallbacks(self._reconnect)
        robot = EmbodiedRobot(self.new_node(transport), transport, options, callbacks)
        robot.start(context.schedule.now_s)
        context.checker.on_started(robot.node)
        self._inbox.clear()
        self._timer_s = math.inf
        self.robot = robot
        self._connect(robot.node.incarnation)

    def _connect(self, incarnation: int) -> None:
        self._sessions += 1
        session = f"{self.number}.{self._sessions}"
        self.context.network.add_process(
            self.id,
            self,
            RobotOnline(self.id, incarnation, session),
            RobotOffline(self.id, incarnation, session),
        )

    def _reconnect(self) -> None:
        assert self.robot is not None, "only a running robot reconnects"
        self.context.checker.counts["reconnects"] += 1
        self.context.network.remove_process(self.id, closes_links=True)
        self._connect(self.robot.node.incarnation)

    def _on_published(self, robot: bytes, kind: str, data: bytes) -> None:
        self.context.checker.on_published(robot, kind, data)
        if kind == "state" and self.robot is not None:
            self.context.checker.inspect(self.robot.node)

    def new_node(self, transport: Transport) -> RobotNode:
        """Return a new incarnation of the robot, from its file, that is not started."""
        context, config = self.context, self.context.config
        streams = numbered_streams(config.seed, self.number, 1)
        batch, _, (robot,) = make_robots(config, [self.id.hex()], streams)
        schema = bytes.fromhex(robot.subpopulation.schema.digest)
        self._store = store = SimulatedStore(
            context.folder / str(self.number), self.id, schema, durable=False
        )
        store.attach(self.id, self.disk, self._countdown, context.checker)
        incarnation = store.begin_incarnation(int(self.unix_s()))
        member = ColonyMember(self._identity, COLONY, self.number, incarnation)
        resources = NodeResources(store, transport, self.unix_s)
        node = _CheckedNode(member, robot, batch, resources, limits=context.limits)
        node.checker = context.checker
        return node

    def crash(self, closes_links: bool = True) -> None:
        """Stop at once; peers notice immediately if the links close, and else after their lease."""
        if self._store is None:
            return
        context = self.context
        context.network.remove_process(self.id, closes_links)
        self._store.abandon()
        if self.robot is not None:
            context.checker.on_stopped(self.robot.node)
        self.robot, self._store, self.is_paused = None, None, False
        if not context.network.is_fault_free:
            is_long = context.rng.random() < 0.2
            down_s = context.rng.uniform(3.0, 9.0) if is_long else context.rng.uniform(0.1, 2.0)
            context.schedule.after(down_s, self.start)

    def stop(self) -> None:
        """Stop as a process does on SIGTERM."""
        self._run_guarded(self._save_and_exit)

    def _save_and_exit(self) -> None:
        if self.robot is None or self.is_paused:
            return
        self.context.network.remove_process(self.id, closes_links=True)
        self.robot.release_body()
        self.robot.node.save()
        self.crash()

    def resume(self) -> None:
        """Continue after a pause, with the events that have arrived meanwhile."""
        self.is_paused = False
        self._timer_s = math.inf
        while self._inbox and self.robot is not None:
            event = self._inbox.popleft()
            self._run_guarded(partial(self._handle_event, event))
        self._run_guarded(self._handle_timers)

    def end_faults(self) -> None:
        """Run from now on without faults."""
        self._countdown.disable()
        self.disk.clear()
        self.resume()
        self.start()

    @property
    def is_operating(self) -> bool:
        """Whether it runs, has a body, and receives observations."""
        if self.robot is None:
            return False
        silent_s = self.context.schedule.now_s - self.robot.observed_s
        return self.robot.has_body and silent_s < _MAX_SILENCE_S

    def unix_s(self) -> float:
        """Return the time of day by the clock of its machine."""
        return _START_UNIX_S + self.context.schedule.now_s + self.clock_error_s

    def _run_guarded(self, action: Callable[[], None]) -> None:
        """Run an action of the process, which crashes where a fault is injected; any other error is a violation."""
        try:
            action()
        except (CrashError, FatalStorageError):
            self.context.checker.counts["crashes"] += 1
            self.crash(self.context.rng.random() < 0.7)
        except StorageFullError:  # an incarnation cannot start
            self.context.checker.counts["no room to start"] += 1
            self.crash()
        except Exception as error:
            frame = traceback.extract_tb(error.__traceback__)[-1]
            where = f"{Path(frame.filename).name}:{frame.lineno}"
            self.context.checker.report(f"{type(error).__name__} at {where}: {error}")
            self.crash()
        else:
            self._set_timer()

    # Inbound events --------------------------------------------------------------------------------------------

    def deliver(self, event: InboundEvent) -> None:
        """Handle an inbound event, now or after the pause."""
        if not self.is_paused:
            self._run_guarded(partial(self._handle_event, event))
        elif len(self._inbox) < _MAX_QUEUED:
            self._inbox.append(event)

    def _handle_event(self, event: InboundEvent) -> None:
        if self.robot is not None:
            self.robot.handle_event(self.context.schedule.now_s, event)

    # The clock -------------------------------------------------------------------------------------------------

    def _set_timer(self) -> None:
        if self.robot is not None and self.robot.next_s < self._timer_s:
            self._timer_s, starts = self.robot.next_s, self._starts
            self.context.schedule.at(self._timer_s, lambda: self._on_timer(starts))

    def _on_timer(self, starts: int) -> None:
        if starts == self._starts and not self.is_paused:
            self._timer_s = math.inf
            self._run_guarded(self._handle_timers)

    def _handle_timers(self) -> None:
        if self.robot is not None:
            self.robot.handle_timers(self.context.schedule.now_s)
