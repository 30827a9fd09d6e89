"""The history of a colony: every birth, mating, death and turnover, in order, chained into one hash."""

import hashlib

import msgspec
import numpy as np

from crcolony.compiled import FloatArray
from crcolony.evolution.lineage import Birth


class Born(msgspec.Struct, frozen=True, tag=True, array_like=True):
    """An agent came into a subpopulation, at a generation's start."""

    tick: int
    robot: int
    generation: int
    agent: str
    genotype: str
    genes: bytes
    """Little-endian float64"""
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
    """An agent's energy came to 0."""

    tick: int
    robot: int
    agent: str


class Lived(msgspec.Struct, frozen=True, tag=True, array_like=True):
    """What an agent made of its life, told when its generation ends."""

    tick: int
    robot: int
    generation: int
    agent: str
    steps: int
    energy: float
    """Mean over the steps it lived"""
    captures: int
    matings: int


class TurnedOver(msgspec.Struct, frozen=True, tag=True, array_like=True):
    """A robot changed its generation."""

    tick: int
    robot: int
    generation: int
    offspring: int


OwnEvent = Born | Died | Lived | TurnedOver
"""What happens to one robot alone; a mating happens to two"""

Event = OwnEvent | Mated

_encoder = msgspec.msgpack.Encoder()


class HistoryHash:
    """A chain over all events: equal hashes mean equal histories, and the chain can go on after a restart."""

    def __init__(self, state: bytes = bytes(16)) -> None:
        self.state = state

    def add(self, event: Event) -> None:
        """Chain one event on."""
        self.state = hashlib.blake2b(self.state + _encoder.encode(event), digest_size=16).digest()

    def __str__(self) -> str:
        return self.state.hex()


def born(tick: int, robot: int, birth: Birth, genes: FloatArray) -> Born:
    """Return the event of a birth."""
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
