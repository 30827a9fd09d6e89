"""A robot of a colony: its lifetime, its storage and its matings, driven by steps, envelopes and time.

No clock, no threads, no sockets: the time is an argument, bytes go out through a `Transport`, and everything that must
survive a crash goes through a `RobotStore`. `EmbodiedRobot` gives it a body; a host process runs many of them.
"""

from collections import Counter
from collections.abc import Callable
from typing import Any

from crcolony.evolution.history import Died, Event, OwnEvent, TurnedOver, birth_event
from crcolony.evolution.lineage import Birth
from crcolony.nodes.mating_decision import MatingDecisions, exchanged_event
from crcolony.nodes.mating_driver import MatingDriver
from crcolony.nodes.node_inputs import ColonyMember, NodeResources
from crcolony.nodes.peer_table import PeerTable
from crcolony.nodes.telemetry_publisher import TelemetryPublisher
from crcolony.protocol.body_messages import Contact
from crcolony.protocol.encounters import EncounterRecord, MatingLimits, Offer, OutcomeReport
from crcolony.protocol.identity import AllowList, RobotId
from crcolony.protocol.mating_messages import pack_genes
from crcolony.protocol.telemetry_messages import EncounterOutcome, Met, RobotState
from crcolony.robot.life_records import lifetimes_of
from crcolony.robot.robot import Robot
from crcolony.robot.state import DIED, MET, SLICE_OVER, Robots
from crcolony.storage.rows import Decision
from crcolony.storage.sql import StorageError
from crcolony.storage.store import StorageFullError

LOCKSTEP_LIMITS = MatingLimits(contact_s=20.0, patience_s=5.0, propose_s=20.0, doubt_s=5.0)
"""In lockstep the arena waits, so that a slow machine must not end a mating: only a robot that is gone does."""


class RobotNode:
    """One robot of a colony. `batch` holds its row of state, `robot` steps it.

    Raises StorageError if the stored robot does not fit, and FatalStorageError when the state of the disk is unknown.
    """

    def __init__(
        self,
        member: ColonyMember,
        robot: Robot,
        batch: Robots,
        resources: NodeResources,
        allow: AllowList | None = None,
        limits: MatingLimits | None = None,
    ) -> None:
        self.member = member
        self.id: RobotId = member.identity.id
        self.colony, self.number = member.colony, member.number
        self.incarnation = member.incarnation
        self.robot = robot
        self.tick = 0
        """Of the last observation"""
        self.arena = ""
        """The arena of its body; empty: it has none"""
        self.matings = self.conceptions = 0
        self.period_ms = 0.0
        """Time between the last two observations"""
        self.peers = PeerTable(self.id, self.incarnation)
        self._batch, self._store = batch, resources.store
        self.telemetry = TelemetryPublisher(member, robot.subpopulation.schema.text, resources)
        self._limits = limits or MatingLimits()
        self._captures_before = 0
        """Batteries captured in generations that have ended"""
        self._unsaved: list[Event] = []
        self._has_unsaved_births = False
        self._decisions = MatingDecisions(robot, batch)
        self._mating = MatingDriver(
            member,
            robot.subpopulation.schema,
            resources.store,
            resources.transport.send_envelope,
            self,
            allow or AllowList(),
            self._limits,
        )

    @property
    def counts(self) -> Counter[str]:
        """Outcomes of encounters and refused envelopes, in this incarnation."""
        return self._mating.counts

    @property
    def captures(self) -> int:
        """Batteries that its agents have captured, in all incarnations."""
        return self._captures_before + int(self._batch.captures[self.robot.row].sum())

    @property
    def waiting(self) -> tuple[EncounterRecord, ...]:
        """Encounters that wait for the partner."""
        return self._mating.mating.open

    def set_lockstep(self, lockstep: bool) -> None:
        """Choose how long to wait for partners: longer in lockstep."""
        self._mating.mating.limits = LOCKSTEP_LIMITS if lockstep else self._limits

    @property
    def is_settled(self) -> bool:
        """Whether no mating can follow from the last observation any more, so that lockstep may continue."""
        return not self._mating.mating.is_pending

    @property
    def next_s(self) -> float:
        """When `handle_timeouts` is due."""
        return self._mating.mating.next_s

    def start(self, now_s: float) -> None:
        """Start from storage, with every conception in it, or as a new robot."""
        self.peers.start(now_s)
        loaded = self._store.load()
        if loaded is None:
            self._report_births(self.robot.start())
            self.save()
        else:
            saved, self.tick = loaded
            self._restore(saved)
        self._mating.resume(now_s)

    def _restore(self, saved: dict[str, Any]) -> None:
        try:
            self.robot.restore(saved)
            self.matings, self.conceptions = saved["matings"], saved["conceptions"]
            self._captures_before = saved.get("captures", 0)
        except (IndexError, KeyError, TypeError, ValueError) as error:
            raise StorageError(f"{self._store.path}: does not fit this config: {error}") from None
        for record, decision in self._store.decisions_since():
            self.matings += 1
            self.conceptions += self._decisions.replay(record, decision)

    # One control period ----------------------------------------------------------------------------------------

    def handle_step_events(self, now_s: float, tick: int, contact: Contact | None) -> None:
        """Handle the events of the control step just made; `contact` is of its observation."""
        self.tick = tick
        events = self.robot.events
        if events & DIED:
            self._record(Died(tick, self.number, self._agent_name))
        # An agent whose birth is not saved must not mate: after a crash another could be born with its name.
        if contact is not None and events & MET and not self._has_unsaved_births:
            own = self.robot.mating_offer()
            self._mating.handle_contact(
                now_s, contact, Offer(own.agent, pack_genes(own.genes)), tick
            )
            self.telemetry.publish_event(Met(tick, contact.robot, own.agent))

    def advance_slice(self) -> None:
        """Hand over to the next agent where a slice is over, and turn over the generation after the last."""
        if self.robot.events & SLICE_OVER and not self.robot.hand_over():
            self._turn_over()

    def _turn_over(self) -> None:
        pool = len(self.robot.subpopulation.pool)
        self._record(TurnedOver(self.tick, self.number, self.robot.generation + 1, pool))
        for lifetime in lifetimes_of(self.robot, self._batch, self.tick, self.number):
            self._record(lifetime)
        self._captures_before = self.captures
        self._report_births(self.robot.turn_over())
        self.save()

    def _report_births(self, births: list[Birth]) -> None:
        genotypes = self.robot.subpopulation.genotypes
        self._has_unsaved_births = True
        for index, birth in enumerate(births):
            self._record(birth_event(self.tick, self.number, birth, genotypes[index]))

    # Envelopes, peers and time ---------------------------------------------------------------------------------

    def set_revoked(self, robots: frozenset[RobotId]) -> None:
        """Mate no more with robots that the authority of the deployment has revoked."""
        self._mating.revoked = robots

    def handle_envelope(self, now_s: float, envelope: bytes) -> None:
        """Handle an envelope from any peer."""
        self._mating.handle_envelope(now_s, envelope)

    def handle_timeouts(self, now_s: float) -> None:
        """Retry what silent partners have not answered, and give up on those that are gone."""
        self._mating.handle_timeouts(now_s)

    def handle_peer_online(
        self, now_s: float, peer: RobotId, incarnation: int, session: str
    ) -> None:
        """Handle a robot's liveliness token that has appeared."""
        if self.peers.add(now_s, peer, (incarnation, session)):
            self._mating.handle_peer_online(now_s, peer)

    def handle_peer_offline(
        self, now_s: float, peer: RobotId, incarnation: int, session: str
    ) -> None:
        """Handle a robot's liveliness token that has gone."""
        if self.peers.remove(peer, (incarnation, session)):
            self._mating.handle_peer_offline(now_s, peer)

    def handle_reconnection(self, now_s: float) -> list[RobotId]:
        """Handle that a new session, without peers yet, was opened; return the peers that were online."""
        peers = self.peers.clear()
        for peer in peers:
            self._mating.handle_peer_offline(now_s, peer)
        return peers

    # Mating (MatingCallbacks) ----------------------------------------------------------------------------------

    def decide(self, record: EncounterRecord) -> Decision:
        """Decide about an offspring by the present energy of the agent that met."""
        return self._decisions.decide(record)

    def rollback_decision(self) -> None:
        """Restore the state before the last decision."""
        self._decisions.rollback()

    def on_mated(self, record: EncounterRecord, decision: Decision) -> None:
        """Count a mating that is on the disk, and publish it."""
        self.matings += 1
        self.conceptions += decision.conceived
        self.telemetry.publish_event(exchanged_event(record, decision))

    def on_outcome(self, report: OutcomeReport) -> None:
        """Publish the outcome of an encounter."""
        self.telemetry.publish_event(
            EncounterOutcome(
                self.tick, report.outcome, report.peer, report.encounter, report.reason
            )
        )

    # Storage and telemetry -------------------------------------------------------------------------------------

    def save(self) -> bool:
        """Write a snapshot of the robot; return False, as a reported fault, if the disk is full."""
        saved = {
            **self.robot.save(),
            "colony": self.colony,
            "matings": self.matings,
            "conceptions": self.conceptions,
            "captures": self._captures_before,
        }
        try:
            self._store.save(saved, self._unsaved, self.tick)
        except StorageFullError as error:
            self.report_fault(f"not saved: {error}")
            return False
        self._unsaved = []
        self._has_unsaved_births = False
        return True

    def report_fault(self, what: str) -> None:
        """Count a fault of the outside, and publish it unless there are too many."""
        self.telemetry.report_fault(self.tick, what)

    def reply_history(self, request: bytes, reply: Callable[[bytes], None]) -> None:
        """Reply to an observer that missed events."""
        self.telemetry.reply_history(self.tick, request, reply)

    def reply_metadata(self, request: bytes, reply: Callable[[bytes], None]) -> None:
        """Reply to an observer with the robot's settings and peers."""
        self.telemetry.reply_metadata(self.tick, request, reply, self.peers)

    def publish_state(self, dropped: int) -> None:
        """Publish the state of the robot; `dropped` counts what its inbox has discarded."""
        self.telemetry.publish_state(self.state(dropped))

    def state(self, dropped: int) -> RobotState:
        """Return the state of the robot as it is published; `dropped` counts what its inbox has discarded."""
        return RobotState(
            robot=self.id,
            number=self.number,
            arena=self.arena,
            incarnation=self.incarnation,
            seq=self.telemetry.seq,
            unix_ms=self.telemetry.unix_ms,
            tick=self.tick,
            generation=self.robot.generation,
            agent=self._agent_name,
            energy=self.robot.energy,
            module=int(self._batch.module[self.robot.row]),
            matings=self.matings,
            conceptions=self.conceptions,
            captures=self.captures,
            pool=len(self.robot.subpopulation.pool),
            waiting=len(self.waiting),
            doubts=self._mating.mating.doubts,
            orphaned=sum(record.orphaned for record in self.waiting),
            peers=len(self.peers),
            refused=self._mating.refused,
            dropped=dropped + self.counts["too many"],
            faults=sum(self.telemetry.faults.values()),
            period_ms=self.period_ms,
        )

    @property
    def _agent_name(self) -> str:
        return self.robot.subpopulation.ids[self.robot.agent]

    def _record(self, event: OwnEvent) -> None:
        """Publish an event, and keep it for the next snapshot."""
        self._unsaved.append(event)
        self.telemetry.publish_event(event)
