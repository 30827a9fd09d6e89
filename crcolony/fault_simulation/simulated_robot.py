"""The process of one robot in virtual time, in place of `processes/robot.py`: it dies between any two effects.

A crash forgets everything but the file of its memory; the next life begins from that, as a real process does.
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
from crcolony.fault_simulation.faults import CrashError, Faults, Hazard
from crcolony.fault_simulation.invariants import InvariantChecker
from crcolony.fault_simulation.simulated_network import (
    Schedule,
    SimulatedNetwork,
    SimulatedTransport,
)
from crcolony.fault_simulation.simulated_store import Disk, SimulatedStore
from crcolony.nodes.embodied_robot import EmbodiedRobot
from crcolony.nodes.robot_node import RobotNode
from crcolony.protocol.body_messages import Contact
from crcolony.protocol.encounters import MatingLimits
from crcolony.protocol.identity import Identity
from crcolony.robot.factory import make_robots, numbered_streams
from crcolony.storage.store import StorageFullError
from crcolony.transport.interface import InboundEvent, RobotOffline, RobotOnline, Transport

COLONY = "simulated"
_BEGINNING_UNIX_S = 1_800_000_000.0
_SNAPSHOT_S, _STATE_PERIOD_S = 8.0, 2.5
_INBOX = 64
"""What a process that is stopped finds when it goes on; the network lets the rest go."""


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


class _WitnessedNode(RobotNode):
    """A robot that is seen to be told of a contact."""

    checker: InvariantChecker

    def handle_step_events(self, now_s: float, tick: int, contact: Contact | None) -> None:
        """See to what happened."""
        if contact is not None:
            self.checker.on_contact(self.id, contact)
        super().handle_step_events(now_s, tick, contact)


class SimulatedRobot:
    """A robot: one life after the other."""

    def __init__(self, number: int, identity: Identity, context: SharedContext) -> None:
        self.id, self.number, self.context = identity.id, number, context
        self.robot: EmbodiedRobot | None = None
        self.is_paused = False
        self.clock_error_s = 0.0
        self._identity = identity
        self._store: SimulatedStore | None = None
        self._hazard = Hazard(context.rng, 0.0)
        self.disk = Disk(context.rng, context.faults.broken_disks)
        self._inbox: deque[InboundEvent] = deque()
        self._alarm_s = math.inf
        self._starts = self._sessions = 0

    # Lives -----------------------------------------------------------------------------------------------------

    def start(self) -> None:
        """Begin a life from the disk, unless one is under way."""
        if self._store is None:
            self._starts += 1
            self._guard(self._begin)

    def _begin(self) -> None:
        context = self.context
        is_calm = context.network.is_calm
        self._hazard = Hazard(context.rng, 0.0 if is_calm else context.faults.crash_operations)
        transport = SimulatedTransport(
            context.network, self.id, self._hazard.strike, self._overhear
        )
        robot = EmbodiedRobot(
            self.new_node(transport), transport, context.config, "arena", self.number, _SNAPSHOT_S,
            self._reconnect_session, state_period_s=_STATE_PERIOD_S,
        )  # fmt: skip
        robot.start(context.schedule.now_s)
        context.checker.on_started(robot.node)
        self._inbox.clear()
        self._alarm_s = math.inf
        self.robot = robot
        self._come_onto_network(robot.node.incarnation)

    def _come_onto_network(self, incarnation: int) -> None:
        self._sessions += 1
        session = f"{self.number}.{self._sessions}"
        self.context.network.add_process(
            self.id,
            self,
            RobotOnline(self.id, incarnation, session),
            RobotOffline(self.id, incarnation, session),
        )

    def _reconnect_session(self) -> None:
        assert self.robot is not None, "only who lives misses another"
        self.context.checker.counts["came anew"] += 1
        self.context.network.remove_process(self.id, says_goodbye=True)
        self._come_onto_network(self.robot.node.incarnation)

    def _overhear(self, robot: bytes, kind: str, data: bytes) -> None:
        self.context.checker.on_published(robot, kind, data)
        if kind == "state" and self.robot is not None:
            self.context.checker.inspect(self.robot.node)

    def new_node(self, transport: Transport) -> RobotNode:
        """Return the robot as its memory has it, in a new life that has not begun."""
        context, config = self.context, self.context.config
        streams = numbered_streams(config.seed, self.number, 1)
        batch, _, (robot,) = make_robots(config, [self.id.hex()], streams)
        schema = bytes.fromhex(robot.subpopulation.schema.digest)
        self._store = store = SimulatedStore(
            context.folder / str(self.number), self.id, schema, durable=False
        )
        store.attach(self.id, self.disk, self._hazard, context.checker)
        incarnation = store.begin_incarnation(int(self.unix_s()))
        node = _WitnessedNode(
            self._identity,
            COLONY,
            self.number,
            robot,
            batch,
            store,
            incarnation,
            transport,
            limits=context.limits,
            unix_s=self.unix_s,
        )
        node.checker = context.checker
        return node

    def crash(self, says_goodbye: bool = True) -> None:
        """Die at once."""
        if self._store is None:
            return
        context = self.context
        context.network.remove_process(self.id, says_goodbye)
        self._store.drop()
        if self.robot is not None:
            context.checker.on_stopped(self.robot.node)
        self.robot, self._store, self.is_paused = None, None, False
        if not context.network.is_calm:
            is_long = context.rng.random() < 0.2
            away_s = context.rng.uniform(3.0, 9.0) if is_long else context.rng.uniform(0.1, 2.0)
            context.schedule.after(away_s, self.start)

    def stop(self) -> None:
        """End as a process does that is asked to."""
        self._guard(self._save_and_leave)

    def _save_and_leave(self) -> None:
        if self.robot is None or self.is_paused:
            return
        self.context.network.remove_process(self.id, says_goodbye=True)
        self.robot.release_body()
        self.robot.node.save()
        self.crash()

    def resume(self) -> None:
        """Go on after a pause, with what has arrived meanwhile."""
        self.is_paused = False
        self._alarm_s = math.inf
        while self._inbox and self.robot is not None:
            event = self._inbox.popleft()
            self._guard(partial(self._take, event))
        self._guard(self._keep_time)

    def be_spared(self) -> None:
        """Nothing goes wrong any more."""
        self._hazard.lift()
        self.disk.clear()
        self.resume()
        self.start()

    @property
    def is_living(self) -> bool:
        """Whether it is there, has a body, and senses something."""
        if self.robot is None:
            return False
        silent_s = self.context.schedule.now_s - self.robot.observed_s
        return self.robot.has_body and silent_s < 1.0

    def unix_s(self) -> float:
        """Return what the clock of this machine says."""
        return _BEGINNING_UNIX_S + self.context.schedule.now_s + self.clock_error_s

    def _guard(self, do: Callable[[], None]) -> None:
        """Do something as a process that ends where it is struck down, or where it does not know what to do."""
        try:
            do()
        except (CrashError, FatalStorageError):
            self.context.checker.counts["crashes"] += 1
            self.crash(self.context.rng.random() < 0.7)
        except StorageFullError:  # a life cannot begin
            self.context.checker.counts["no room to begin"] += 1
            self.crash()
        except Exception as error:
            frame = traceback.extract_tb(error.__traceback__)[-1]
            where = f"{Path(frame.filename).name}:{frame.lineno}"
            self.context.checker.complain(f"{type(error).__name__} at {where}: {error}")
            self.crash()
        else:
            self._set_alarm()

    # What arrives ----------------------------------------------------------------------------------------------

    def deliver(self, event: InboundEvent) -> None:
        """Take what has arrived, now or after the pause."""
        if not self.is_paused:
            self._guard(partial(self._take, event))
        elif len(self._inbox) < _INBOX:
            self._inbox.append(event)

    def _take(self, event: InboundEvent) -> None:
        if self.robot is not None:
            self.robot.handle_event(self.context.schedule.now_s, event)

    # The clock -------------------------------------------------------------------------------------------------

    def _set_alarm(self) -> None:
        if self.robot is not None and self.robot.next_s < self._alarm_s:
            self._alarm_s, starts = self.robot.next_s, self._starts
            self.context.schedule.at(self._alarm_s, lambda: self._events(starts))

    def _events(self, starts: int) -> None:
        if starts == self._starts and not self.is_paused:
            self._alarm_s = math.inf
            self._guard(self._keep_time)

    def _keep_time(self) -> None:
        if self.robot is not None:
            self.robot.handle_timers(self.context.schedule.now_s)
