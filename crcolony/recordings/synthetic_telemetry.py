"""Synthetic telemetry: the samples that the robots of a past colony would have published for its history."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeVar

import msgspec

from crcolony.evolution.history import Born, Event, Lived, Mated, TurnedOver
from crcolony.nodes.scene import SceneBody, make_scene
from crcolony.protocol.codec import Message, encode
from crcolony.protocol.identity import RobotId
from crcolony.protocol.key_expressions import ArenaToken, RobotToken
from crcolony.protocol.mating_messages import Encounter
from crcolony.protocol.telemetry_messages import (
    MAX_REPORTED_PEERS,
    ArenaMetadata,
    EventMessage,
    Exchanged,
    Met,
    RobotEvent,
    RobotMetadata,
    RobotState,
)
from crcolony.telemetry.samples import (
    ArenaMetadataSample,
    EventSample,
    OnlineSample,
    RobotMetadataSample,
    SceneSample,
    StateSample,
    TelemetrySample,
)
from crcolony.world.state import World

ARENA = "arena"
"""Name of the arena, which a history does not hold."""
ARENA_RUN = 0
"""Id of the run of the arena, which a history does not hold."""
INCARNATION = 0
"""Incarnation of every robot, which a history does not hold."""
_SESSION = "synthetic"
_AGENT_FIELDS = ("agent", "partner", "mother", "father")
"""Fields of events that name agents."""

OneEvent = TypeVar("OneEvent", bound=Event)


@dataclass(frozen=True)
class RobotSnapshot:
    """The part of a robot's state that does not follow from its events."""

    agent: str
    """In control, by its name in the history; empty: unknown"""
    energy: float
    module: int
    """-1: none, or unknown"""
    captures: int
    """Batteries captured in this generation so far"""
    pool: int


@dataclass
class _Counts:
    """Counts over the events of one robot, in all its generations."""

    seq: int = 0
    generation: int = 0
    matings: int = 0
    conceptions: int = 0
    captures: int = 0
    """In generations that have ended"""
    proposals: int = 0


class SyntheticTelemetry:
    """Makes samples of robots that the history knows by their numbers; `robots` are their ids.

    Tick 0 is at `start_unix_ms`, and a tick takes `period_s`.
    """

    def __init__(
        self, colony: str, robots: Sequence[RobotId], start_unix_ms: int, period_s: float
    ) -> None:
        self._colony, self._robots = colony, tuple(robots)
        self._bodies = [SceneBody(robot, colony, slot) for slot, robot in enumerate(robots)]
        self._start_unix_ms, self._period_s = start_unix_ms, period_s
        self._counts = [_Counts() for _ in robots]
        self._scenes = 0

    def initial_samples(
        self, robot_settings: str, arena_settings: str
    ) -> Iterator[TelemetrySample]:
        """Yield the samples of tick 0: arena and robots come online, and reply with their settings (JSON)."""
        unix_ms = self._unix_ms(0)
        arena_token = ArenaToken(ARENA, ARENA_RUN, _SESSION)
        yield OnlineSample(token=arena_token, unix_ms=unix_ms, size_bytes=0)
        for robot in self._robots:
            token = RobotToken(self._colony, robot, INCARNATION, _SESSION)
            yield OnlineSample(token=token, unix_ms=unix_ms, size_bytes=0)
        arena = ArenaMetadata(ARENA, ARENA_RUN, arena_settings)
        yield ArenaMetadataSample(metadata=arena, unix_ms=unix_ms, size_bytes=_size(arena))
        for robot in self._robots:
            peers = [peer for peer in self._robots if peer != robot][:MAX_REPORTED_PEERS]
            metadata = RobotMetadata(robot, INCARNATION, robot_settings, peers, "")
            yield RobotMetadataSample(
                colony=self._colony, metadata=metadata, unix_ms=unix_ms, size_bytes=_size(metadata)
            )

    def event_samples(self, event: Event) -> Iterator[TelemetrySample]:
        """Yield the samples of an event: of a mating one of each robot, and none of a robot without an id."""
        if isinstance(event, Mated):
            yield from self._mating_samples(with_robot_ids(event, self._robots))
        elif self._has_id(event.robot):
            counts = self._counts[event.robot]
            if isinstance(event, Born | TurnedOver):
                counts.generation = event.generation
            elif isinstance(event, Lived):
                counts.captures += event.captures
            yield self._event_sample(event.robot, with_robot_ids(event, self._robots))

    def _mating_samples(self, mated: Mated) -> Iterator[TelemetrySample]:
        numbers = (mated.robot, mated.partner_robot)
        if not all(map(self._has_id, numbers)):
            return
        initiator, responder = sorted(numbers, key=self._robots.__getitem__)
        self._counts[initiator].proposals += 1
        encounter = Encounter(
            self._robots[initiator],
            self._robots[responder],
            INCARNATION,
            self._counts[initiator].proposals,
        )
        sides = (
            (mated.agent, mated.energy, mated.conceived),
            (mated.partner, mated.partner_energy, mated.partner_conceived),
        )
        for own, other in ((0, 1), (1, 0)):
            (agent, energy, conceived), partner = sides[own], sides[other][0]
            counts = self._counts[numbers[own]]
            counts.matings += 1
            counts.conceptions += conceived
            met = Met(mated.tick, self._robots[numbers[other]], agent)
            yield self._event_sample(numbers[own], met)
            exchanged = Exchanged(mated.tick, encounter, agent, partner, energy, conceived, False)
            yield self._event_sample(numbers[own], exchanged)

    def _event_sample(self, number: int, event: RobotEvent) -> TelemetrySample:
        counts = self._counts[number]
        counts.seq += 1
        unix_ms = self._unix_ms(event.tick)
        message = EventMessage(self._robots[number], INCARNATION, counts.seq, unix_ms, event)
        return EventSample(
            colony=self._colony, message=message, unix_ms=unix_ms, size_bytes=_size(message)
        )

    def state_sample(self, number: int, tick: int, snapshot: RobotSnapshot) -> TelemetrySample:
        """Return the state of a robot at a tick."""
        counts, unix_ms = self._counts[number], self._unix_ms(tick)
        state = RobotState(
            robot=self._robots[number],
            number=number,
            arena=ARENA,
            incarnation=INCARNATION,
            seq=counts.seq,
            unix_ms=unix_ms,
            tick=tick,
            generation=counts.generation,
            agent=agent_with_robot_id(snapshot.agent, self._robots),
            energy=snapshot.energy,
            module=snapshot.module,
            matings=counts.matings,
            conceptions=counts.conceptions,
            captures=counts.captures + snapshot.captures,
            pool=snapshot.pool,
            waiting=0,
            doubts=0,
            orphaned=0,
            peers=len(self._robots) - 1,
            refused=0,
            dropped=0,
            faults=0,
            period_ms=1000.0 * self._period_s,
        )
        return StateSample(
            colony=self._colony, state=state, unix_ms=unix_ms, size_bytes=_size(state)
        )

    def scene_sample(self, world: World, tick: int) -> TelemetrySample:
        """Return the scene of the arena at a tick."""
        self._scenes += 1
        unix_ms = self._unix_ms(tick)
        scene = make_scene(world, self._bodies, ARENA, ARENA_RUN, self._scenes, tick, unix_ms)
        return SceneSample(scene=scene, unix_ms=unix_ms, size_bytes=_size(scene))

    def _has_id(self, number: int) -> bool:
        return 0 <= number < len(self._robots)

    def _unix_ms(self, tick: int) -> int:
        return self._start_unix_ms + round(1000.0 * tick * self._period_s)


def _size(message: Message) -> int:
    """Return the bytes that a message takes on the network."""
    return len(encode(message))


def with_robot_ids(event: OneEvent, robots: Sequence[RobotId]) -> OneEvent:
    """Return an event in which the names of agents begin with robots' ids instead of their numbers."""
    changes = {
        field: agent_with_robot_id(name, robots)
        for field in _AGENT_FIELDS
        if (name := getattr(event, field, None)) is not None
    }
    return msgspec.structs.replace(event, **changes)


def agent_with_robot_id(name: str, robots: Sequence[RobotId]) -> str:
    """Return an agent's name with its robot's id; the name of an agent of any other robot stays as it is."""
    number, slash, own = name.partition("/")
    is_number = number.isascii() and number.isdigit() and len(number) < 8
    return (
        f"{robots[int(number)].hex()}{slash}{own}"
        if is_number and int(number) < len(robots)
        else name
    )
