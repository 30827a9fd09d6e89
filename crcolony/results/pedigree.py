"""The pedigree of a run: which agent is the offspring of which, read from its history."""

import sqlite3
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from crcolony.compiled import IntArray
from crcolony.results.history_database import HISTORY_DATABASE
from crcolony.storage.files import FolderError
from crcolony.storage.sql import connect_read_only

NOBODY = -1
"""The index of a parent that an agent does not have."""
MAX_AGENTS = 200_000
"""A larger pedigree is not read: what is passed on along it would take gigabytes."""


@dataclass(frozen=True)
class Pedigree:
    """All agents that were ever born, in the order of their births; all arrays are (agents,)."""

    generation: IntArray
    mother: IntArray
    """Index of the parent in the same robot; NOBODY in the first generation"""
    father: IntArray
    """Index of the parent in the partner; NOBODY for a mutated copy of the mother"""
    offspring: IntArray
    """Index of the first agent born of the same offspring: one that is drawn from the pool twice becomes two agents"""
    layers: tuple[IntArray, ...]
    """Indices of all agents: first the founders, then again and again those whose parents have come before"""


def read_pedigree(folder: Path) -> Pedigree:
    """Read the pedigree of a run; raises FolderError if it cannot be read, is too large, or lacks parents."""
    path = folder / HISTORY_DATABASE
    try:
        with closing(connect_read_only(path)) as database:
            births = database.execute(
                "SELECT agent, generation, genotype, mother, father FROM births ORDER BY rowid"
            ).fetchall()
    except sqlite3.Error as error:
        raise FolderError(f"{path}: {error}") from None
    if len(births) > MAX_AGENTS:
        raise FolderError(f"{path}: more than {MAX_AGENTS} agents")
    try:
        return pedigree_of(births)
    except KeyError as error:
        raise FolderError(f"{path}: the parent {error} of an agent is not in it") from None
    except ValueError as error:
        raise FolderError(f"{path}: corrupt: {error}") from None


def pedigree_of(births: Sequence[tuple[str, int, str, str | None, str | None]]) -> Pedigree:
    """Return the pedigree of births: agent, generation, hash of the genes, mother, father.

    Agents of the same parents and the same genes are of one offspring: mutation makes any two differ, but for one of
    some hundred crossovers of identical parents. Raises KeyError for a parent that is not among the agents, and
    ValueError for agents that are their own ancestors.
    """
    indices = {birth[0]: index for index, birth in enumerate(births)}
    indices_of_offspring: dict[tuple[str, str, str], int] = {}
    offspring = np.arange(len(births))
    for index, (_, _, genotype, mother, father) in enumerate(births):
        if mother is not None and father is not None:
            offspring[index] = indices_of_offspring.setdefault((genotype, mother, father), index)
    generation = np.array([birth[1] for birth in births])
    mothers = np.array([NOBODY if birth[3] is None else indices[birth[3]] for birth in births])
    fathers = np.array([NOBODY if birth[4] is None else indices[birth[4]] for birth in births])
    return Pedigree(generation, mothers, fathers, offspring, _layers(mothers, fathers))


def _layers(mothers: IntArray, fathers: IntArray) -> tuple[IntArray, ...]:
    """Return indices so that parents come in an earlier layer than their offspring."""
    has_come: NDArray[np.bool_] = np.zeros(mothers.size + 1, dtype=np.bool_)
    has_come[NOBODY] = True  # an agent without a parent waits for nobody
    layers = []
    waiting = np.arange(mothers.size)
    while waiting.size:
        is_due = has_come[mothers[waiting]] & has_come[fathers[waiting]]
        if not is_due.any():
            raise ValueError("agents that are their own ancestors")
        layers.append(waiting[is_due])
        has_come[waiting[is_due]] = True
        waiting = waiting[~is_due]
    return tuple(layers)
