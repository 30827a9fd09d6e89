"""The exact ledger of a colony, over the stores of all its robots: what must hold whatever faults occurred."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from crcolony.evolution.history import Born, TurnedOver
from crcolony.protocol.mating_messages import pack_genes
from crcolony.results.merged_history import merge_robots
from crcolony.storage.reading import StoredRobot, read_stored_robot


@dataclass(frozen=True)
class Ledger:
    """The totals of a colony."""

    matings: int
    conceptions: int
    aborted: int
    """Encounters that a responder was prepared for and that did not take place"""
    turnovers: int


def check_ledger(paths: Sequence[Path], *, is_settled: bool = True) -> Ledger:
    """Check the stores of robots that have all restarted and have been stopped.

    Every mating has both sides, with the genotypes that were sent; none is open; and every conception is in the pool
    or was there at a turnover. Robots that had not settled may have been stopped during a mating: then it is open on
    both disks, or on one and done on the other, and continues when they restart.
    """
    stored_robots = [read_stored_robot(path) for path in paths]
    records = {
        (stored.robot, record.encounter): record
        for stored in stored_robots
        for record, _ in stored.matings
    }
    waiting = {key for key, record in records.items() if record.state in ("decided", "prepared")}
    assert not (is_settled and waiting), "an encounter is open"
    for side in merge_robots(stored_robots).one_sided:
        assert (side.record.peer, side.record.encounter) in waiting, "a mating has one side only"
    total: Counter[str] = Counter()
    for stored in stored_robots:
        decided = [record for record, choice in stored.matings if choice is not None]
        encounters = [record.encounter for record in decided]
        assert len(set(encounters)) == len(encounters), "an encounter is decided twice"
        for record, choice in stored.matings:
            assert (record.state in ("mated", "decided")) == (choice is not None), record
        for record in decided:
            other = records[record.peer, record.encounter]
            if record.proof and other.proof:  # older ones keep no genes
                assert record.partner == other.own, "what arrived is not what was sent"
        total["decided"] += len(decided)
        total["conceptions"] += _check_conceptions(stored)
        total["aborted"] += len(stored.matings) - len(decided)
        total["turnovers"] += sum(isinstance(event, TurnedOver) for event in stored.events)
    return Ledger(total["decided"] // 2, total["conceptions"], total["aborted"], total["turnovers"])


def _check_conceptions(stored: StoredRobot) -> int:
    """Check that a robot's offspring are those it conceived, no more and no less; return how many.

    Of older encounters it keeps that they led to an offspring, and not which.
    """
    children = [choice.child for _, choice in stored.matings if choice and choice.conceived]
    pools = [event.offspring for event in stored.events if isinstance(event, TurnedOver)]
    assert sum(pools) + len(stored.pool) == len(children), "a conception is lost, or invented"
    conceived = Counter(children)
    waiting = Counter(pack_genes(offspring.genes) for offspring in stored.pool)
    assert waiting <= conceived, "an offspring in the pool has no conception"
    of_two = [event for event in stored.events if isinstance(event, Born) and event.father]
    unknown = sum(event.genes not in conceived for event in of_two)
    assert unknown <= conceived[b""], "a newborn agent has no conception"
    return len(children)
