"""The faults of a simulated colony: the mix of one seed, crashes between two operations, forged envelopes.

Swarm testing (Groce et al. 2012): every kind of fault is on or off by seed, so that none masks what another would show.
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
    """A simulated process is killed at this point. Only the simulation catches it."""


@dataclass(frozen=True)
class Faults:
    """The probability of each kind of fault, or whether it occurs at all; 0 or False: never."""

    loss: float = 0.0
    duplication: float = 0.0
    tail: float = 0.0
    """Share of messages with a far longer delay"""
    forgery: float = 0.0
    """Share of envelopes that are followed by a forged one"""
    crash_operations: float = 0.0
    """Mean number of operations before a process is killed between two of them"""
    kills: bool = False
    stops: bool = False
    pauses: bool = False
    partitions: bool = False
    clogs: bool = False
    full_disks: bool = False
    broken_disks: bool = False
    """Some of the crashes start with a disk error after which the state of the disk is unknown"""
    clock_jumps: bool = False
    arena_restarts: bool = False

    def __str__(self) -> str:
        values = ((field.name, getattr(self, field.name)) for field in fields(self))
        return ", ".join(
            name if value is True else f"{name} {value:.3g}" for name, value in values if value
        )


def draw_faults(rng: Random) -> Faults:
    """Return the faults of a seed, each kind on or off."""

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


class CrashCountdown:
    """Crashes one process after a random number of operations, unless it is disabled before."""

    def __init__(self, rng: Random, operations: float) -> None:
        self._left = int(rng.expovariate(1.0 / operations)) if operations else -1

    def count(self, error: type[Exception] = CrashError) -> None:
        """Count one operation; raises `error` where the process crashes."""
        if self._left < 0:
            return
        self._left -= 1
        if self._left < 0:
            raise error("injected crash")

    def disable(self) -> None:
        """Never crash the process."""
        self._left = -1


class Forger:
    """Forges envelopes from genuine ones: damaged, or altered and signed by their senders for another colony."""

    def __init__(self, rng: Random, schema: Schema, robots: Mapping[RobotId, Identity]) -> None:
        self._rng, self._schema, self._robots = rng, schema, robots

    def forge(self, envelope: bytes) -> bytes | None:
        """Return an envelope that no robot may accept."""
        if self._rng.random() < 0.3:
            at = self._rng.randrange(len(envelope))
            changed = envelope[at] ^ self._rng.randrange(1, 256)
            return envelope[:at] + bytes([changed]) + envelope[at + 1 :]
        _, message = open_envelope(envelope)
        return sign_message(self._altered(message), "elsewhere", self._robots[sender_of(message)])

    def _altered(self, message: MatingMessage) -> MatingMessage:
        """Return a message that would do harm in place of this one."""
        encounter = message.encounter
        if isinstance(message, Propose | Accept) and self._rng.random() < 0.7:
            genes = self._schema.random(np.random.default_rng(self._rng.getrandbits(32)))
            return msgspec.structs.replace(message, genes=pack_genes(genes))
        if isinstance(message, BY_INITIATOR):
            return Commit(encounter) if self._rng.random() < 0.5 else Abort(encounter)
        return Done(encounter) if self._rng.random() < 0.5 else Refuse(encounter, "busy")
