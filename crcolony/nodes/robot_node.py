"""A robot as a citizen of its colony: its mind, its memory and its matings, driven by observations, letters and time.

No clock, no threads, no sockets: time is passed in, bytes go out through a `Transport`, and everything that must
survive goes through a `RobotStore`. `embodied_robot.py` gives it a body; a host runs many, and the simulation of
`simulation/` whole colonies of them.
"""

import itertools
import math
import time
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np

from crcolony.evolution.history import Died, Event, OwnEvent, TurnedOver, birth_event
from crcolony.evolution.lineage import Birth
from crcolony.evolution.population import Offspring
from crcolony.nodes.event_buffer import EventBuffer
from crcolony.nodes.mating_driver import MatingDriver
from crcolony.protocol.body_messages import Contact
from crcolony.protocol.codec import WireError, encode
from crcolony.protocol.encounters import EncounterRecord, MatingLimits, Offer, OutcomeReport
from crcolony.protocol.identity import AllowList, Identity, RobotId
from crcolony.protocol.mating_messages import pack_genes, unpack_genes
from crcolony.protocol.telemetry_messages import (
    MAX_REPORTED_PEERS,
    EncounterOutcome,
    Exchanged,
    Fault,
    Met,
    RobotEvent,
    RobotMetadata,
    RobotState,
    decode_history_request,
)
from crcolony.randomness import generator
from crcolony.rate_limit import TokenBucket
from crcolony.robot.life_records import lifetimes_of
from crcolony.robot.robot import MatingOffer, Robot
from crcolony.robot.state import DIED, MET, SLICE_OVER, Robots
from crcolony.storage.rows import Decision
from crcolony.storage.sql import StorageError
from crcolony.storage.store import RobotStore, StorageFullError
from crcolony.transport.interface import Transport

LOCKSTEP_LIMITS = MatingLimits(contact_s=20.0, patience_s=5.0, propose_s=20.0, doubt_s=5.0)
"""In lockstep the arena waits, so that a slow machine must not end a mating: only a robot that is gone does."""

_FAULTS_PER_S, _ANSWERS_PER_S = 10.0, 100.0
"""What strangers can make a robot say, at most."""
_TWIN_PATIENCE_S = 7.0
"""The token of a process that died goes with its lease; one that stays longer than two leases belongs to a live one."""
_TWIN_WITHIN_S = 10.0
"""Only who is there when a robot begins is its twin: tokens prove nothing, and must not end a robot that lives."""


class RobotNode:
    """One robot of a colony. `batch` holds its row, `robot` is its mind.

    Raises StorageError if the memory does not fit, and FatalStorageError when nobody knows what is on the disk.
    """

    def __init__(
        self,
        identity: Identity,
        colony: str,
        number: int,
        robot: Robot,
        batch: Robots,
        store: RobotStore,
        incarnation: int,
        transport: Transport,
        allow: AllowList | None = None,
        limits: MatingLimits | None = None,
        unix_s: Callable[[], float] = time.time,
        on_event: Callable[[RobotEvent], None] = lambda event: None,
    ) -> None:
        self.id: RobotId = identity.id
        self.colony = colony
        self.number = number
        self.incarnation = incarnation
        self.robot = robot
        self.tick = 0
        """Of the last observation"""
        self.arena = ""
        """Where its body is"""
        self.settings = "{}"
        """What it tells of its body, learning, life and heredity: JSON"""
        self.faults: Counter[str] = Counter()
        self.matings = self.conceptions = 0
        self._captures_before = 0
        """In generations that have ended"""
        self.period_ms = 0.0
        self.peers: dict[RobotId, dict[tuple[int, str], None]] = {}
        """The lives and sessions of every other robot on the network"""
        self.session = ""
        """Of the transport, as its own token has it"""
        self._twins: dict[tuple[int, str], float] = {}
        self._begun_s = math.inf
        self._batch, self._store, self._transport = batch, store, transport
        self._events = EventBuffer(self.id, incarnation)
        self._limits = limits or MatingLimits()
        self._unix_s, self._on_event = unix_s, on_event
        self._told_faults, self._answered = TokenBucket(_FAULTS_PER_S), TokenBucket(_ANSWERS_PER_S)
        self._unsaved: list[Event] = []
        self._has_unsaved_births = False
        self._before: tuple[Any, list[Offspring], int] | None = None
        self._mating = MatingDriver(
            identity,
            colony,
            robot.subpopulation.schema,
            store,
            transport.send_envelope,
            self,
            allow or AllowList(),
            self._limits,
            incarnation,
        )

    @property
    def counts(self) -> Counter[str]:
        """What became of encounters and letters, in this life."""
        return self._mating.counts

    @property
    def captures(self) -> int:
        """How many batteries its agents have captured, in all its lives."""
        return self._captures_before + int(self._batch.captures[self.robot.row].sum())

    @property
    def waiting(self) -> tuple[EncounterRecord, ...]:
        """Encounters that wait for a partner."""
        return self._mating.mating.open

    def set_lockstep(self, lockstep: bool) -> None:
        """Wait for partners as the arena's clock allows."""
        self._mating.mating.limits = LOCKSTEP_LIMITS if lockstep else self._limits

    @property
    def is_settled(self) -> bool:
        """Whether no mating can come any more of what was observed: lockstep goes on then."""
        return not self._mating.mating.is_awaited

    @property
    def next_s(self) -> float:
        """When `handle_timeouts` has something to do."""
        return self._mating.mating.next_s

    def start(self, now_s: float) -> None:
        """Come to life: from memory, with every conception in it, or as a new robot."""
        self._begun_s = now_s
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
            self._replay_decision(record, decision)

    def _replay_decision(self, record: EncounterRecord, decision: Decision) -> None:
        """Take up a decision that is younger than the snapshot."""
        self.matings += 1
        self.robot.stream[...] = np.frombuffer(decision.stream, dtype="<u8")
        if not decision.conceived or record.partner is None:
            return
        self.conceptions += 1
        genes = unpack_genes(decision.child, self.robot.subpopulation.schema)
        offspring = Offspring(genes, record.own.agent, record.partner.agent, decision.step)
        self.robot.subpopulation.add_to_pool(offspring, generator(self.robot.stream.copy()))

    # One control period ----------------------------------------------------------------------------------------

    def handle_step_events(self, now_s: float, tick: int, contact: Contact | None) -> None:
        """See to what happened to the robot in the control step just made, a mating first."""
        self.tick = tick
        events = self.robot.events
        if events & DIED:
            self._record(Died(tick, self.number, self._agent_name))
        # Whoever is not on the disk yet mates with nobody: after a crash its name may be another's.
        if contact is not None and events & MET and not self._has_unsaved_births:
            own = self.robot.mating_offer()
            self._mating.handle_contact(
                now_s, contact, Offer(own.agent, pack_genes(own.genes)), tick
            )
            self._tell(Met(tick, contact.robot, own.agent))

    def advance_slice(self) -> None:
        """Hand over to the next agent where a slice is over, and turn over the generation after the last."""
        if self.robot.events & SLICE_OVER and not self.robot.hand_over():
            self._turn_over()

    def _turn_over(self) -> None:
        pool = len(self.robot.subpopulation.pool)
        self._record(TurnedOver(self.tick, self.number, self.robot.generation + 1, pool))
        for incarnation in lifetimes_of(self.robot, self._batch, self.tick, self.number):
            self._record(incarnation)
        self._captures_before = self.captures
        self._report_births(self.robot.turn_over())
        self.save()

    def _report_births(self, births: list[Birth]) -> None:
        genotypes = self.robot.subpopulation.genotypes
        self._has_unsaved_births = True
        for place, birth in enumerate(births):
            self._record(birth_event(self.tick, self.number, birth, genotypes[place]))

    # Letters, peers and time -----------------------------------------------------------------------------------

    def handle_envelope(self, now_s: float, envelope: bytes) -> None:
        """Take a letter from anybody."""
        self._mating.handle_envelope(now_s, envelope)

    def handle_timeouts(self, now_s: float) -> None:
        """Remind partners that are silent, and give up on those that are gone."""
        self._mating.handle_timeouts(now_s)

    def handle_peer_online(
        self, now_s: float, peer: RobotId, incarnation: int, session: str
    ) -> None:
        """Hear that a robot is on the network."""
        if peer == self.id:
            was_there = now_s <= self._begun_s + _TWIN_WITHIN_S
            if was_there and (incarnation, session) < (self.incarnation, self.session):
                self._twins[incarnation, session] = now_s
            return
        is_back = peer not in self.peers
        self.peers.setdefault(peer, {})[incarnation, session] = None
        if is_back:
            self._mating.handle_peer_online(now_s, peer)

    @property
    def has_duplicate(self) -> bool:
        """Whether a process that was there before has this robot's key; that of a dead one goes with its lease."""
        return bool(self._twins)

    def duplicate_session(self, now_s: float) -> str | None:
        """Return the session of an older process that has this robot's key and does not go away, if there is one."""
        for (_, session), seen_s in self._twins.items():
            if now_s - seen_s > _TWIN_PATIENCE_S:
                return session
        return None

    def handle_peer_offline(
        self, now_s: float, peer: RobotId, incarnation: int, session: str
    ) -> None:
        """Hear that a robot, in one life, is on the network no more."""
        if peer == self.id:
            self._twins.pop((incarnation, session), None)
        incarnations = self.peers.get(peer, {})
        incarnations.pop((incarnation, session), None)
        if peer in self.peers and not incarnations:
            del self.peers[peer]
            self._mating.handle_peer_offline(now_s, peer)

    # What a mating makes of the robot (exchanges.Parent) -------------------------------------------------------

    def decide(self, record: EncounterRecord) -> Decision:
        """Decide by the energy, now, of the agent that met; an agent of an earlier generation has no offspring."""
        robot, subpopulation = self.robot, self.robot.subpopulation
        self._before = (robot.stream.copy(), list(subpopulation.pool), subpopulation.conceived)
        assert record.partner is not None, "a mating is decided when the partner's genes are here"
        is_alive = record.own.agent in subpopulation.ids
        offspring, energy = None, 0.0
        if is_alive:
            place = subpopulation.ids.index(record.own.agent)
            energy = float(self._batch.energies[robot.row, place])
            genes = unpack_genes(record.partner.genes, subpopulation.schema)
            offspring = robot.mate(MatingOffer(record.partner.agent, genes), place)
        return Decision(
            energy=energy,
            conceived=offspring is not None,
            too_late=not is_alive,
            child=pack_genes(offspring.genes) if offspring else b"",
            step=robot.steps,
            stream=robot.stream.astype("<u8").tobytes(),
        )

    def rollback_decision(self) -> None:
        """Go back to before the last decision."""
        assert self._before is not None, "only a decision is taken back"
        stream, pool, conceived = self._before
        self.robot.stream[...] = stream
        self.robot.subpopulation.pool = pool
        self.robot.subpopulation.conceived = conceived

    def on_mated(self, record: EncounterRecord, decision: Decision) -> None:
        """Count a mating that is on the disk, and tell of it."""
        assert record.partner is not None
        self.matings += 1
        self.conceptions += decision.conceived
        self._tell(
            Exchanged(
                record.tick,
                record.encounter,
                record.own.agent,
                record.partner.agent,
                decision.energy,
                decision.conceived,
                decision.too_late,
            )
        )

    def on_outcome(self, note: OutcomeReport) -> None:
        """Tell how an encounter goes."""
        self._tell(
            EncounterOutcome(self.tick, note.outcome, note.peer, note.encounter, note.reason)
        )

    # Memory and telemetry --------------------------------------------------------------------------------------

    def save(self) -> bool:
        """Put the whole robot on the disk; return False, and go on, if there is no room for it now."""
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
        """Count something outside that went wrong, and tell of it, unless there is too much of it to tell."""
        self.faults[what.partition(":")[0]] += 1
        if self._told_faults.allow(self._unix_s()):
            self._tell(Fault(self.tick, what[:500]))

    def reply_history(self, request: bytes, answer: Callable[[bytes], None]) -> None:
        """Answer an observer that missed events, unless the question is malformed, or one too many."""
        try:
            ask = decode_history_request(request)
        except WireError as error:
            self.report_fault(f"malformed question: {error}")
            return
        if self._may_answer():
            answer(encode(self._events.reply_to(ask)))

    def reply_metadata(self, request: bytes, answer: Callable[[bytes], None]) -> None:
        """Answer an observer that asks what the robot is like and whom it sees, with the same limits."""
        if request:
            self.report_fault("malformed question: it is not empty")
        elif self._may_answer():
            peers = list(itertools.islice(self.peers, MAX_REPORTED_PEERS))
            answer(encode(RobotMetadata(self.id, self.incarnation, self.settings, peers)))

    def _may_answer(self) -> bool:
        may_answer = self._answered.allow(self._unix_s())
        if not may_answer:
            self.report_fault("malformed question: too many questions")
        return may_answer

    def publish_state(self, dropped: int) -> None:
        """Tell how the robot is."""
        self._transport.publish_telemetry(self.id, "state", encode(self.state(dropped)))

    def state(self, dropped: int) -> RobotState:
        """Return how the robot is; `dropped` counts what its inbox had to let go."""
        subpopulation = self.robot.subpopulation
        counts = self.counts
        return RobotState(
            robot=self.id,
            number=self.number,
            arena=self.arena,
            incarnation=self.incarnation,
            seq=self._events.seq,
            unix_ms=self._unix_ms(),
            tick=self.tick,
            generation=self.robot.generation,
            agent=self._agent_name,
            energy=self.robot.energy,
            module=int(self._batch.module[self.robot.row]),
            matings=self.matings,
            conceptions=self.conceptions,
            captures=self.captures,
            pool=len(subpopulation.pool),
            waiting=len(self.waiting),
            doubts=self._mating.mating.doubts,
            orphaned=sum(record.orphaned for record in self.waiting),
            peers=len(self.peers),
            refused=sum(counts[why] for why in ("malformed", "forged", "unfit", "not allowed")),
            dropped=dropped + counts["too many"],
            faults=sum(self.faults.values()),
            period_ms=self.period_ms,
        )

    @property
    def _agent_name(self) -> str:
        return self.robot.subpopulation.ids[self.robot.agent]

    def _record(self, event: OwnEvent) -> None:
        self._unsaved.append(event)
        self._tell(event)

    def _tell(self, event: RobotEvent) -> None:
        self._on_event(event)
        self._transport.publish_telemetry(
            self.id, "event", self._events.append(event, self._unix_ms())
        )

    def _unix_ms(self) -> int:
        return max(0, int(1000.0 * self._unix_s()))
