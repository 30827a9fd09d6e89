"""Prints what is in a robot's file, as text or as a table for spreadsheets (`crcolony inspect`)."""

import contextlib
import csv
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from crcolony.config import Config, ConfigError, load
from crcolony.evolution.history import Born, Lived
from crcolony.protocol.codec import WireError
from crcolony.protocol.encounters import EncounterRecord
from crcolony.protocol.envelope import has_valid_signature, open_envelope
from crcolony.protocol.mating_messages import Accept, Propose, pack_genes
from crcolony.robot.genes import agent_schema
from crcolony.storage.reading import StoredRobot, read_stored_robot
from crcolony.storage.rows import Decision

_COLONY = "colony"
"""The default name of a colony, for a file that holds no snapshot yet."""
_ANCESTORS = 3
"""Generations that a printed lineage goes back."""

Proof = Literal["signed", "other", "mismatch"]
"""Whether the partner's message confirms a record: signed for this colony, not signed for it, or of other content."""


@dataclass(frozen=True)
class Row:
    """A row of a table; each gene gets a column of its own."""

    values: Sequence[object]
    genes: bytes = b""


def inspect_robot(path: Path, table: str | None) -> None:
    """Print a summary of a robot's file, or one table of it as comma-separated values; raises StorageError."""
    stored = read_stored_robot(path)
    if table is None:
        print("\n".join(_format_summary(stored)))
        return
    columns, rows = _TABLES[table](stored)
    genes = max((len(row.genes) // 8 for row in rows), default=0)
    names = gene_names(path, stored.schema)
    if len(names) != genes:
        names = [f"gene {place}" for place in range(genes)]
    writer = csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow([*columns, *names])
    for row in rows:
        values = np.frombuffer(row.genes, dtype="<f8").tolist() or [""] * genes
        writer.writerow([*row.values, *values])


# As text ------------------------------------------------------------------------------------------------------------


def _format_summary(stored: StoredRobot) -> Iterator[str]:
    yield f"file of robot {stored.robot.hex()}"
    if stored.saved_unix_s is None or stored.tick is None:
        yield f"incarnation {stored.incarnation}, nothing saved yet"
    else:
        when = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(stored.saved_unix_s))
        yield f"incarnation {stored.incarnation}, generation {stored.generation}, saved {when} at tick {stored.tick}"
    yield from _format_matings(stored)
    yield from _format_open(stored)
    yield f"offspring pool: {len(stored.pool)} for the next generation"
    yield _format_proofs(stored)
    yield from _format_lineage(stored)


def _format_matings(stored: StoredRobot) -> Iterator[str]:
    states = Counter(record.state for record, _ in stored.matings)
    named = ", ".join(f"{count} {state}" for state, count in states.most_common())
    yield f"encounters: {len(stored.matings)}" + (f" ({named})" if named else "")
    decided = [(record.peer, d) for record, d in stored.matings if d is not None]
    conceived = Counter(peer for peer, decision in decided if decision.conceived)
    too_late = sum(decision.too_late for _, decision in decided)
    partners = Counter(peer for peer, _ in decided)
    yield (
        f"matings: {len(decided)} with {_counted(len(partners), 'partner')},"
        f" {conceived.total()} offspring"
        + (f", {too_late} too late for their generation" if too_late else "")
    )
    for peer, count in partners.most_common():
        yield f"  {peer.hex()[:8]}: {_counted(count, 'mating')}, {conceived[peer]} offspring"


def _format_open(stored: StoredRobot) -> Iterator[str]:
    waiting = [record for record, _ in stored.matings if record.is_unresolved]
    yield f"open encounters: {len(waiting)}"
    for record in waiting:
        what = "in doubt" if record.state == "prepared" else "decided, not acknowledged"
        orphaned = ", orphaned: the partner did not come back" if record.orphaned else ""
        yield f"  with {record.peer.hex()[:8]} since tick {record.tick}: {what}{orphaned}"


def _format_proofs(stored: StoredRobot) -> str:
    colony = _colony_of(stored)
    proofs = Counter(proof_of(record, colony) for record, _ in stored.matings if record.proof)
    if not proofs:
        return "partners' signed messages: none"
    message = f"partners' signed messages: {proofs['signed']} of {proofs.total()} valid for colony {colony}"
    if proofs["mismatch"]:
        message += f", {proofs['mismatch']} DO NOT MATCH the records of this file"
    if proofs["other"]:
        message += f", {proofs['other']} for another colony or forged"
    return message


def _format_lineage(stored: StoredRobot) -> Iterator[str]:
    births = {event.agent: event for event in stored.events if isinstance(event, Born)}
    if not births:
        yield "lineage: no agent is born yet"
        return
    newest = max(born.generation for born in births.values())
    living = [born for born in births.values() if born.generation == newest]
    yield f"lineage of the {len(living)} living agents (mother × father, {_ANCESTORS} generations back):"
    for born in living:
        steps = [_short(born.agent)]
        ancestor: Born | None = born
        for _ in range(_ANCESTORS):
            if ancestor is None or ancestor.mother is None:
                break
            father = f" × {_short(ancestor.father)}" if ancestor.father else ""
            steps.append(f"{_short(ancestor.mother)}{father}")
            ancestor = births.get(ancestor.mother)
        yield "  " + " ← ".join(steps)


def _short(agent: str) -> str:
    robot, slash, own = agent.partition("/")
    return f"{robot[:8]}{slash}{own}"


def _counted(count: int, what: str) -> str:
    return f"{count} {what}" + ("" if count == 1 else "s")


def _colony_of(stored: StoredRobot) -> str:
    return stored.colony or _COLONY


def proof_of(record: EncounterRecord, colony: str) -> Proof:
    """Return whether the partner's message confirms the record, and whether it is signed for this colony."""
    try:
        envelope, message = open_envelope(record.proof)
    except WireError:
        return "mismatch"
    expected = Propose if record.role == "responder" else Accept
    partner = record.partner
    if (
        not isinstance(message, expected)
        or partner is None
        or (message.encounter, message.nonce) != (record.encounter, record.nonce)
        or (message.agent, message.genes) != (partner.agent, partner.genes)
    ):
        return "mismatch"
    return "signed" if has_valid_signature(envelope, colony) else "other"


# As a table ---------------------------------------------------------------------------------------------------------

Table = tuple[Sequence[str], list[Row]]


def _matings(stored: StoredRobot) -> Table:
    columns = (
        "tick", "role", "state", "orphaned", "partner_robot", "incarnation", "count", "agent",
        "partner", "proof", "energy", "conceived", "too_late", "step",
    )  # fmt: skip
    colony = _colony_of(stored)
    return columns, [_mating_row(record, decision, colony) for record, decision in stored.matings]


def _mating_row(record: EncounterRecord, decision: Decision | None, colony: str) -> Row:
    """Return the row of an encounter, with the genes of the offspring if there is one."""
    encounter, partner = record.encounter, record.partner
    own: list[object] = [
        record.tick,
        record.role,
        record.state,
        int(record.orphaned),
        record.peer.hex(),
        encounter.incarnation,
        encounter.count,
        record.own.agent,
        partner.agent if partner else "",
        proof_of(record, colony) if record.proof else "",
    ]
    if decision is None:
        return Row([*own, "", "", "", ""])
    decided = [decision.energy, int(decision.conceived), int(decision.too_late), decision.step]
    return Row(own + decided, decision.child)


def _births(stored: StoredRobot) -> Table:
    columns = ("tick", "generation", "agent", "mother", "father", "genotype")
    return columns, [
        Row([b.tick, b.generation, b.agent, b.mother, b.father, b.genotype], b.genes)
        for b in stored.events
        if isinstance(b, Born)
    ]


def _lives(stored: StoredRobot) -> Table:
    columns = ("tick", "generation", "agent", "steps", "energy", "captures", "matings")
    return columns, [
        Row([getattr(event, name) for name in columns])
        for event in stored.events
        if isinstance(event, Lived)
    ]


def _pool(stored: StoredRobot) -> Table:
    return ("step", "mother", "father"), [
        Row([child.step, child.mother, child.father], pack_genes(child.genes))
        for child in stored.pool
    ]


_TABLES: dict[str, Callable[[StoredRobot], Table]] = {
    "matings": _matings,
    "births": _births,
    "lives": _lives,
    "pool": _pool,
}


def gene_names(path: Path, schema: bytes) -> list[str]:
    """Return the names of a schema's genes, from the default config or that of the file's results folder.

    The list is empty if neither has this schema.
    """
    for config in _configs(path):
        candidate = agent_schema(config.learning, config.heredity)
        if candidate.digest == schema.hex():
            return [gene.name for gene in candidate.genes]
    return []


def _configs(path: Path) -> Iterator[Config]:
    yield Config()
    for folder in list(path.absolute().parents)[:3]:  # `launch` puts robots into OUT/robots/0
        with contextlib.suppress(ConfigError):
            yield load(folder / "config.toml")
