"""The history of a colony: all births, matings, deaths, lifetimes and turnovers, and their hash.

The names of the classes and the order of their fields are part of the hash and of every recording.
"""

import hashlib

import msgspec
import numpy as np

from crcolony.compiled import FloatArray
from crcolony.evolution.lineage import Birth


class Born(msgspec.Struct, frozen=True, tag=True, array_like=True):
    """An agent joined a subpopulation at the start of a generation."""

    tick: int
    robot: int
    generation: int
    agent: str
    genotype: str
    """Content hash of the genes."""
    genes: bytes
    """Little-endian float64."""
    mother: str | None
    father: str | None


class Mated(msgspec.Struct, frozen=True, tag=True, array_like=True):
    """Two robots exchanged genotypes; each decided for itself whether to conceive."""

    tick: int
    robot: int
    partner_robot: int
    agent: str
    partner: str
    energy: float
    partner_energy: float
    conceived: bool
    partner_conceived: bool


class Died(msgspec.Struct, frozen=True, tag=True, array_like=True):
    """An agent starved: its energy fell to 0."""

    tick: int
    robot: int
    agent: str


class Lived(msgspec.Struct, frozen=True, tag=True, array_like=True):
    """What an agent achieved in its lifetime, recorded when its generation ends."""

    tick: int
    robot: int
    generation: int
    agent: str
    steps: int
    energy: float
    """Mean over its steps."""
    captures: int
    matings: int


class TurnedOver(msgspec.Struct, frozen=True, tag=True, array_like=True):
    """A robot started its next generation."""

    tick: int
    robot: int
    generation: int
    offspring: int
    """Size of the pool that it was drawn from."""


OwnEvent = Born | Died | Lived | TurnedOver
"""An event of one robot; a mating is one of two."""

Event = OwnEvent | Mated

_encoder = msgspec.msgpack.Encoder()


class HistoryHash:
    """A hash chain over all events: equal hashes mean equal histories. `state` (16 bytes) resumes a
    chain."""

    def __init__(self, state: bytes = bytes(16)) -> None:
        self.state = state

    def add(self, event: Event) -> None:
        """Append one event to the chain."""
        self.state = hashlib.blake2b(self.state + _encoder.encode(event), digest_size=16).digest()

    def __str__(self) -> str:
        return self.state.hex()


def birth_event(tick: int, robot: int, birth: Birth, genes: FloatArray) -> Born:
    """Return the event of a birth; `genes` is (genes,)."""
    return Born(
        tick,
        robot,
        birth.generation,
        birth.agent,
        birth.genotype,
        np.ascontiguousarray(genes, dtype="<f8").tobytes(),
        birth.mother,
        birth.father,
    )
