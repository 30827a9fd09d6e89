"""A history told as the robots of its colony would have told it on the network, had anybody been there to listen."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeVar

import msgspec

from crcolony.evolution.history import Born, Event, Lived, Mated, TurnedOver
from crcolony.nodes.scene import SceneBody, make_scene
from crcolony.protocol.codec import encode
from crcolony.protocol.identity import RobotId
from crcolony.protocol.key_expressions import ArenaKeys, ColonyKeys
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
from crcolony.telemetry.colony_monitor import TelemetrySample
from crcolony.world.state import World

ARENA, ARENA_RUN, INCARNATION = "arena", 0, 0
"""What is said to be so of a run of which nobody knows it"""
_SESSION = "retold"
_AGENTS = ("agent", "partner", "mother", "father")
"""Fields of events that name agents"""

OneEvent = TypeVar("OneEvent", bound=Event)


@dataclass(frozen=True)
class RobotSnapshot:
    """How a robot is at one moment, as far as its events do not tell."""

    agent: str
    """In control, by its name in the history; empty: nobody knows"""
    energy: float
    module: int
    """-1: none, or nobody knows"""
    captures: int
    """Batteries captured in this generation so far"""
    pool: int


@dataclass
class _Account:
    """What one robot has told so far, in all its generations."""

    seq: int = 0
    generation: int = 0
    matings: int = 0
    conceptions: int = 0
    captures: int = 0
    """In generations that have ended"""
    proposals: int = 0


class SyntheticTelemetry:
    """Tells of robots that are known by their numbers; `robots` are their ids.

    Tick 0 is at `start_unix_ms`, and a tick takes `period_s`.
    """

    def __init__(
        self, colony: str, robots: Sequence[RobotId], start_unix_ms: int, period_s: float
    ) -> None:
        self._robots = tuple(robots)
        self._bodies = [SceneBody(robot, colony, slot) for slot, robot in enumerate(robots)]
        self._keys, self._arena = ColonyKeys(colony), ArenaKeys(ARENA)
        self._start_unix_ms, self._period_s = start_unix_ms, period_s
        self._accounts = [_Account() for _ in robots]
        self._scenes = 0

    def start(self, robot_settings: str, arena_settings: str) -> Iterator[TelemetrySample]:
        """Let arena and robots come onto the network, and say what they are like: settings as JSON."""
        unix_ms = self._unix_ms(0)
        yield TelemetrySample("alive", self._arena.alive(ARENA_RUN, _SESSION), b"", unix_ms)
        for robot in self._robots:
            yield TelemetrySample(
                "alive", self._keys.alive(robot, INCARNATION, _SESSION), b"", unix_ms
            )
        nature = ArenaMetadata(ARENA, ARENA_RUN, arena_settings)
        yield TelemetrySample("metadata", self._arena.metadata, encode(nature), unix_ms)
        for robot in self._robots:
            peers = [peer for peer in self._robots if peer != robot][:MAX_REPORTED_PEERS]
            about = RobotMetadata(robot, INCARNATION, robot_settings, peers)
            yield TelemetrySample("metadata", self._keys.metadata(robot), encode(about), unix_ms)

    def event_samples(self, event: Event) -> Iterator[TelemetrySample]:
        """Tell an event; of a mating both robots tell. Of a robot that has no id nothing is told."""
        if isinstance(event, Mated):
            yield from self._tell_mating(named(event, self._robots))
        elif self._knows(event.robot):
            account = self._accounts[event.robot]
            if isinstance(event, Born | TurnedOver):
                account.generation = event.generation
            elif isinstance(event, Lived):
                account.captures += event.captures
            yield self._published(event.robot, named(event, self._robots))

    def _tell_mating(self, mated: Mated) -> Iterator[TelemetrySample]:
        numbers = (mated.robot, mated.partner_robot)
        if not all(map(self._knows, numbers)):
            return
        initiator, responder = sorted(numbers, key=self._robots.__getitem__)
        self._accounts[initiator].proposals += 1
        encounter = Encounter(
            self._robots[initiator],
            self._robots[responder],
            INCARNATION,
            self._accounts[initiator].proposals,
        )
        sides = (
            (mated.agent, mated.energy, mated.conceived),
            (mated.partner, mated.partner_energy, mated.partner_conceived),
        )
        for own, other in ((0, 1), (1, 0)):
            (agent, energy, conceived), partner = sides[own], sides[other][0]
            account = self._accounts[numbers[own]]
            account.matings += 1
            account.conceptions += conceived
            met = Met(mated.tick, self._robots[numbers[other]], agent)
            yield self._published(numbers[own], met)
            exchanged = Exchanged(mated.tick, encounter, agent, partner, energy, conceived, False)
            yield self._published(numbers[own], exchanged)

    def _published(self, number: int, event: RobotEvent) -> TelemetrySample:
        robot, account = self._robots[number], self._accounts[number]
        account.seq += 1
        unix_ms = self._unix_ms(event.tick)
        message = EventMessage(robot, INCARNATION, account.seq, unix_ms, event)
        return TelemetrySample("event", self._keys.event(robot), encode(message), unix_ms)

    def state(self, number: int, tick: int, condition: RobotSnapshot) -> TelemetrySample:
        """Tell how a robot is."""
        robot, account = self._robots[number], self._accounts[number]
        unix_ms = self._unix_ms(tick)
        state = RobotState(
            robot=robot,
            number=number,
            arena=ARENA,
            incarnation=INCARNATION,
            seq=account.seq,
            unix_ms=unix_ms,
            tick=tick,
            generation=account.generation,
            agent=agent_by_id(condition.agent, self._robots),
            energy=condition.energy,
            module=condition.module,
            matings=account.matings,
            conceptions=account.conceptions,
            captures=account.captures + condition.captures,
            pool=condition.pool,
            waiting=0,
            doubts=0,
            orphaned=0,
            peers=len(self._robots) - 1,
            refused=0,
            dropped=0,
            faults=0,
            period_ms=1000.0 * self._period_s,
        )
        return TelemetrySample("state", self._keys.state(robot), encode(state), unix_ms)

    def scene(self, world: World, tick: int) -> TelemetrySample:
        """Tell how the arena is."""
        self._scenes += 1
        unix_ms = self._unix_ms(tick)
        scene = make_scene(world, self._bodies, ARENA, ARENA_RUN, self._scenes, tick, unix_ms)
        return TelemetrySample("scene", self._arena.scene, encode(scene), unix_ms)

    def _knows(self, number: int) -> bool:
        return 0 <= number < len(self._robots)

    def _unix_ms(self, tick: int) -> int:
        return self._start_unix_ms + round(1000.0 * tick * self._period_s)


def named(event: OneEvent, robots: Sequence[RobotId]) -> OneEvent:
    """Return an event in which agents are named by their robots' ids instead of their numbers."""
    changes = {
        field: agent_by_id(name, robots)
        for field in _AGENTS
        if (name := getattr(event, field, None)) is not None
    }
    return msgspec.structs.replace(event, **changes)


def agent_by_id(name: str, robots: Sequence[RobotId]) -> str:
    """Return an agent's name with its robot's id; of a robot that is not among these, its name as it is."""
    number, slash, own = name.partition("/")
    is_number = number.isascii() and number.isdigit() and len(number) < 8
    return (
        f"{robots[int(number)].hex()}{slash}{own}"
        if is_number and int(number) < len(robots)
        else name
    )
