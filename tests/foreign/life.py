"""The agents of the robot: their genes, their energy, their offspring, and what it tells observers of them."""

import random
import time
from collections import deque
from collections.abc import Callable
from hashlib import blake2b
from typing import Final

from tests.foreign.messages import HISTORY_EVENTS, Message, encode
from tests.foreign.records import Record, Records
from tests.foreign.species import Species

FIRST_ENERGY: Final = 0.8
ENERGY_PER_STEP: Final = 0.0002
MATES_ABOVE: Final = 0.1
EVENTS_KEPT: Final = 10_000


class Agents:
    """One agent after the other lives, each for its lifetime, and an offspring follows when one waits."""

    def __init__(
        self,
        robot: bytes,
        incarnation: int,
        records: Records,
        species: Species,
        publish: Callable[[bytes], None],
    ) -> None:
        self.robot, self.incarnation = robot, incarnation
        self.species = species
        self.seq = self.tick = self.generation = self.captures = 0
        self.energy = FIRST_ENERGY
        self.agent, self.genes = "", b""
        self.first_genes = b""
        """Of an agent without parents; empty: they are drawn"""
        self.lifetime_steps = 600
        self._steps = 0
        self._luck = random.Random()
        self._records, self._publish = records, publish
        self._events: deque[bytes] = deque(maxlen=EVENTS_KEPT)

    def begin(self) -> None:
        """The agent that lived when the robot was stopped, or a first one."""
        agent, genes = self._records.fact("agent"), self._records.fact("genes")
        self.generation = int(self._records.fact("generation") or b"0")
        if agent is not None and genes is not None and self.species.has(genes):
            self.agent, self.genes = agent.decode(), genes
        else:
            self._be_born(self.first_genes or self.species.drawn(self._luck), None, None)

    @property
    def wants_to_mate(self) -> bool:
        return self.energy > MATES_ABOVE

    def step(self, tick: int, charge: float) -> None:
        self.tick = tick
        self.captures += charge > 0.0
        self.energy = max(0.0, min(1.0, self.energy + charge - ENERGY_PER_STEP))
        self._steps += 1
        if self._steps >= self.lifetime_steps:
            self._turn_over()

    def _turn_over(self) -> None:
        self.generation += 1
        self._tell("TurnedOver", self.tick, 0, self.generation, self._records.pool())
        waiting = self._records.next_offspring()
        if waiting is None:
            self._be_born(self.genes, self.agent, None)
        else:
            number, genes, mother, father = waiting
            self._be_born(genes, mother, father, number)

    def _be_born(
        self, genes: bytes, mother: str | None, father: str | None, offspring: int | None = None
    ) -> None:
        records = self._records
        with records.write():  # its name is on disk before it mates: no other agent gets it
            births = int(records.fact("births") or b"0")
            self.agent, self.genes = f"{self.robot.hex()}/{births}", genes
            records.set_fact("births", str(births + 1).encode())
            records.set_fact("agent", self.agent.encode())
            records.set_fact("genes", genes)
            records.set_fact("generation", str(self.generation).encode())
            if offspring is not None:
                records.take_from_pool(offspring)
        self.energy, self._steps = FIRST_ENERGY, 0
        schema = self.species.digest.hex().encode()
        genotype = blake2b(schema + genes, digest_size=16).hexdigest()
        parents = (mother, father)
        self._tell("Born", self.tick, 0, self.generation, self.agent, genotype, genes, *parents)

    # What the state machine of the matings asks of the robot.

    def are_genes(self, genes: bytes) -> bool:
        return self.species.has(genes)

    def conceives(self, record: Record, records: Records) -> bool:
        """By its own energy and its own luck, in the transaction of the mating."""
        if record.agent != self.agent or self._luck.random() >= self.energy:
            return False
        child = self.species.crossed(record.genes, record.partner_genes, self._luck)
        records.conceive(child, record.agent, record.partner_agent)
        return True

    def outcome(self, outcome: str, record: Record, reason: str = "") -> None:
        self._tell(
            "EncounterOutcome", self.tick, outcome, record.partner, list(record.encounter), reason
        )
        if outcome != "mated":
            print(
                f"mating with {record.partner.hex()[:8]}: {outcome} {reason}".rstrip(), flush=True
            )

    def exchanged(self, record: Record) -> None:
        is_late = record.agent != self.agent
        energy = 0.0 if is_late else self.energy
        partner = (record.agent, record.partner_agent, energy, record.conceived, is_late)
        self._tell("Exchanged", record.tick, list(record.encounter), *partner)
        conceived = "conceived" if record.conceived else "not conceived"
        print(f"mated with {record.partner.hex()[:8]} as {record.role}, {conceived}", flush=True)

    def met(self, peer: bytes) -> None:
        self._tell("Met", self.tick, peer, self.agent)

    # Observers.

    def _tell(self, *event: object) -> None:
        self.seq += 1
        message = encode(
            ["event", self.robot, self.incarnation, self.seq, int(1000 * time.time()), list(event)]
        )
        self._events.append(message)
        self._publish(message)

    def history(self, incarnation: int, first: int) -> Message:
        """The events from `first` on, as many as a reply may have."""
        oldest = self.seq - len(self._events) + 1
        events: list[bytes] = []
        if incarnation == self.incarnation:
            begin = max(0, first - oldest)
            for event in list(self._events)[begin : begin + HISTORY_EVENTS]:
                if sum(map(len, events)) + len(event) > 100_000:
                    break
                events.append(event)
        return ["history_reply", self.incarnation, oldest, events]
