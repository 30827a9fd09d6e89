"""What goes wrong in a simulated colony: the mix of one seed, the moment a process is struck down, forged letters.

Swarm testing (Groce et al. 2012): every kind of fault is on or off by seed, so that none hides what another would show.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from random import Random

import msgspec
import numpy as np

from crcolony.evolution.genotype import Schema
from crcolony.protocol.envelope import open_envelope, sign_message
from crcolony.protocol.identity import Identity, RobotId
from crcolony.protocol.mating_messages import (
    BY_INITIATOR,
    Abort,
    Accept,
    Commit,
    Done,
    MatingMessage,
    Propose,
    Refuse,
    pack_genes,
    sender_of,
)


class CrashError(Exception):
    """A simulated process is killed at this very point. Only the simulation catches it."""


@dataclass(frozen=True)
class Faults:
    """How likely everything is that can go wrong; 0 or False: it does not."""

    loss: float = 0.0
    duplication: float = 0.0
    tail: float = 0.0
    """Share of messages that take far longer than others"""
    forgery: float = 0.0
    """Share of letters that a forged one goes along with"""
    crash_operations: float = 0.0
    """A process does so many things, on average, before it is struck down between two of them"""
    kills: bool = False
    stops: bool = False
    pauses: bool = False
    partitions: bool = False
    clogs: bool = False
    full_disks: bool = False
    broken_disks: bool = False
    """Some of the crashes begin as an error of which nobody knows what it left on the disk"""
    clock_jumps: bool = False
    arena_restarts: bool = False

    def __str__(self) -> str:
        values = ((field.name, getattr(self, field.name)) for field in fields(self))
        return ", ".join(
            name if value is True else f"{name} {value:.3g}" for name, value in values if value
        )


def draw_faults(rng: Random) -> Faults:
    """Return the faults of a seed, every kind on or off."""

    def maybe(low: float, high: float) -> float:
        value = rng.uniform(low, high)
        return value if rng.random() < 0.5 else 0.0

    kinds = [field.name for field in fields(Faults) if field.type is bool]
    return Faults(
        loss=maybe(0.02, 0.4),
        duplication=maybe(0.01, 0.1),
        tail=maybe(0.02, 0.2),
        forgery=maybe(0.1, 0.5),
        crash_operations=maybe(20.0, 120.0),
        **{kind: rng.random() < 0.5 for kind in kinds},
    )


class Hazard:
    """Strikes one process down after a drawn number of operations; it may be lifted."""

    def __init__(self, rng: Random, operations: float) -> None:
        self._left = int(rng.expovariate(1.0 / operations)) if operations else -1

    def strike(self, error: type[Exception] = CrashError) -> None:
        """Count one operation; raises `error` where the process ends."""
        if self._left < 0:
            return
        self._left -= 1
        if self._left < 0:
            raise error("struck down")

    def lift(self) -> None:
        """Let the process live."""
        self._left = -1


class Forger:
    """Makes false letters of genuine ones: damaged, or signed by their senders, but for another colony."""

    def __init__(self, rng: Random, schema: Schema, robots: Mapping[RobotId, Identity]) -> None:
        self._rng, self._schema, self._robots = rng, schema, robots

    def forge(self, envelope: bytes) -> bytes | None:
        """Return a letter that nobody may believe."""
        if self._rng.random() < 0.3:
            place = self._rng.randrange(len(envelope))
            changed = envelope[place] ^ self._rng.randrange(1, 256)
            return envelope[:place] + bytes([changed]) + envelope[place + 1 :]
        _, message = open_envelope(envelope)
        return sign_message(self._twisted(message), "elsewhere", self._robots[sender_of(message)])

    def _twisted(self, message: MatingMessage) -> MatingMessage:
        """Return what would do harm in place of a message."""
        encounter = message.encounter
        if isinstance(message, Propose | Accept) and self._rng.random() < 0.7:
            genes = self._schema.random(np.random.default_rng(self._rng.getrandbits(32)))
            return msgspec.structs.replace(message, genes=pack_genes(genes))
        if isinstance(message, BY_INITIATOR):
            return Commit(encounter) if self._rng.random() < 0.5 else Abort(encounter)
        return Done(encounter) if self._rng.random() < 0.5 else Refuse(encounter, "busy")
