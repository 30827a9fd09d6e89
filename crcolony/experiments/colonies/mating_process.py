"""The matings of one robot of a colony in one process, by the real protocol in virtual time.

State machine, timers and decisions are those of robots as processes (`protocol/mating.py`, `nodes/mating_decision.py`).
Not real are what carries and keeps them: messages are neither encoded nor signed, since nobody forges any here, and the
disk is in memory, never full, and as soon written as asked for.
"""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from crcolony.fault_simulation.simulated_network import Schedule
from crcolony.nodes.mating_decision import MatingDecisions
from crcolony.protocol.encounters import (
    Effect,
    EncounterRecord,
    MatingLimits,
    Offer,
    OutcomeReport,
    Send,
    Write,
)
from crcolony.protocol.identity import RobotId
from crcolony.protocol.mating import MatingStateMachine
from crcolony.protocol.mating_messages import Encounter, MatingMessage, pack_genes
from crcolony.robot.robot import Robot
from crcolony.robot.state import Robots
from crcolony.storage.rows import Decision

_ID_BYTES = 16


def robot_id_of(row: int) -> RobotId:
    """Return the id of the robot of a row: the smaller one proposes first."""
    return row.to_bytes(_ID_BYTES, "big")


class DiskInMemory:
    """What of a robot outlives its process."""

    def __init__(self) -> None:
        self.starts = 0
        self.snapshot: dict[str, Any] = {}
        self.decisions: list[tuple[EncounterRecord, Decision]] = []
        """Since the snapshot"""
        self.open: dict[Encounter, EncounterRecord] = {}
        """Encounters that wait for the partner"""
        self.marks: dict[RobotId, tuple[tuple[int, int], bool]] = {}
        """See `RobotStore.marks`"""

    def save(self, snapshot: dict[str, Any]) -> None:
        """Write a snapshot; what was decided before is in it."""
        self.snapshot, self.decisions = snapshot, []

    def write(self, records: Sequence[EncounterRecord]) -> None:
        """Write records, each in place of the former one of its encounter."""
        for record in records:
            encounter = record.encounter
            if record.is_unresolved:
                self.open[encounter] = record
            else:
                self.open.pop(encounter, None)
            last, _ = self.marks.get(encounter.initiator, ((-1, -1), False))
            if record.role == "responder" and encounter.number >= last:
                self.marks[encounter.initiator] = encounter.number, record.state == "mated"


class MatingProcess:
    """The process of the robot of a row, one incarnation after another.

    `send` carries a message to a robot, or loses it. `on_decided` is called with every decision about offspring.
    """

    def __init__(
        self,
        robot: Robot,
        batch: Robots,
        schedule: Schedule,
        send: Callable[[RobotId, MatingMessage], None],
        on_decided: Callable[[EncounterRecord, Decision], None],
    ) -> None:
        self.id = robot_id_of(robot.row)
        self.outcomes: Counter[str] = Counter()
        """Of encounters, in all incarnations"""
        self._robot, self._batch, self._schedule = robot, batch, schedule
        self._send, self._on_decided = send, on_decided
        self._schema = bytes.fromhex(robot.subpopulation.schema.digest)
        self._disk = DiskInMemory()
        self._machine: MatingStateMachine | None = None
        self._timer_s = math.inf

    @property
    def is_running(self) -> bool:
        """Whether the process is there."""
        return self._machine is not None

    @property
    def open(self) -> int:
        """Number of encounters that wait for the partner, on the disk."""
        return len(self._disk.open)

    def start(self) -> None:
        """Start an incarnation: the first, or from the last snapshot, with every conception since."""
        disk, robot = self._disk, self._robot
        if disk.starts:
            robot.restore(disk.snapshot)
            decisions = MatingDecisions(robot, self._batch)
            for record, decision in disk.decisions:
                decisions.replay(record, decision)
        else:
            self.save()
        disk.starts += 1
        self._decisions = MatingDecisions(robot, self._batch)
        self._machine = MatingStateMachine(self.id, disk.starts, self._schema, MatingLimits())
        self._timer_s = math.inf
        self._machine.restore(self._schedule.now_s, disk.open.values(), disk.marks)
        self._set_timer(self._machine)

    def kill(self) -> None:
        """Stop at once: what is not on the disk is lost."""
        self._machine = None

    def save(self) -> None:
        """Write a snapshot."""
        self._disk.save(self._robot.save())

    def handle_contact(self, peer: RobotId, nonce: int, tick: int) -> None:
        """Handle that the robot has met another."""
        own = self._robot.mating_offer()
        offer = Offer(own.agent, pack_genes(own.genes))
        self._handle(lambda machine, now_s: machine.handle_contact(now_s, peer, nonce, offer, tick))

    def handle_message(self, message: MatingMessage) -> None:
        """Handle a message that has arrived."""
        self._handle(lambda machine, now_s: machine.handle_message(now_s, message, b""))

    def handle_peer_online(self, peer: RobotId) -> None:
        """Handle that another robot's process is there."""
        self._handle(lambda machine, now_s: machine.handle_peer_online(now_s, peer))

    def handle_peer_offline(self, peer: RobotId) -> None:
        """Handle that another robot's process is gone."""
        self._handle(lambda machine, now_s: machine.handle_peer_offline(now_s, peer))

    def _handle(self, event: Callable[[MatingStateMachine, float], list[Effect]]) -> None:
        """Carry out what follows from an event, unless the process is gone."""
        if self._machine is None:
            return
        for effect in event(self._machine, self._schedule.now_s):
            match effect:
                case Write():
                    self._write(effect)
                case Send(to=to, message=message):
                    self._send(to, message)
                case OutcomeReport(outcome=outcome):
                    self.outcomes[outcome] += 1
        self._set_timer(self._machine)

    def _write(self, write: Write) -> None:
        self._disk.write(write.records)
        if write.decided is not None:
            decision = self._decisions.decide(write.decided)
            self._disk.decisions.append((write.decided, decision))
            self._on_decided(write.decided, decision)

    def _set_timer(self, machine: MatingStateMachine) -> None:
        if machine.next_s < self._timer_s:
            self._timer_s = machine.next_s
            self._schedule.at(self._timer_s, partial(self._on_timer, self._disk.starts))

    def _on_timer(self, starts: int) -> None:
        if starts == self._disk.starts and self._schedule.now_s >= self._timer_s:
            self._timer_s = math.inf
            self._handle(lambda machine, now_s: machine.handle_timeouts(now_s))
