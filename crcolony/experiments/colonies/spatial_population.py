"""A population that moves, eats and meets in a plane: the simplest world in which ways of dying and breeding differ.

A generation begins at random places. An individual goes to the nearest zone of energy while its own is below its
threshold, and else to the nearest other one that wants to mate, but never twice in a row to the same. Two genes are
inherited: `skill`, the speed, and `threshold`. The plane is a torus of side 1. Within a generation nobody is born, and
whoever dies lies still.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from crcolony.compiled import FloatArray, IntArray

SKILL, THRESHOLD = 0, 1
"""Columns of the genes; both are from 0 to 1"""
HIGHEST_SPEED = 0.01
"""A step, with a skill of 1"""
ZONE_RADIUS = 0.04
ZONE_ENERGY = 0.05
"""A step within a zone; 1 is full"""
STEP_ENERGY = 0.012
"""What a step costs"""
CONTACT = 0.02
"""Distance at which two mate"""
REFRACTORY_STEPS = 20
"""After a mating, in which it goes away in any direction"""
MUTATION_SD = 0.05


@dataclass
class Population:
    """Individuals, of whom every array has one row; a mask makes a part of them."""

    places: FloatArray
    """(N, 2)"""
    headings: FloatArray
    """(N, 2) where it goes while it seeks nothing"""
    genes: FloatArray
    """(N, 2)"""
    energies: FloatArray
    """0 (starving) to 1"""
    ages: IntArray
    """In generations"""
    matings: IntArray
    """In this generation"""
    refractory: IntArray
    """Steps until it may mate again"""
    partner: IntArray
    """The last one in this generation, -1: none"""
    is_alive: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.places)

    def part(self, chosen: NDArray[np.bool_] | IntArray) -> "Population":
        """Return copies of some individuals."""
        return Population(*(getattr(self, field.name)[chosen] for field in fields(self)))

    def joined(self, others: "Population") -> "Population":
        """Return these and others."""
        return Population(
            *(
                np.concatenate([getattr(self, field.name), getattr(others, field.name)])
                for field in fields(self)
            )
        )


OnMating = Callable[[int, int], None]
"""Called with the indices of two that have mated"""


def new_individuals(places: FloatArray, genes: FloatArray, energy: float) -> Population:
    """Return newborns at places (N, 2) with genes (N, 2)."""
    count = len(places)
    return Population(
        places.copy(),
        np.zeros((count, 2)),
        genes.copy(),
        np.full(count, energy),
        np.zeros(count, dtype=np.int64),
        np.zeros(count, dtype=np.int64),
        np.zeros(count, dtype=np.int64),
        np.full(count, -1),
        np.ones(count, dtype=np.bool_),
    )


def founders(count: int, energy: float, rng: np.random.Generator) -> Population:
    """Return unskilled individuals at random places."""
    genes = np.stack([rng.uniform(0.2, 0.6, count), rng.uniform(0.0, 1.0, count)], axis=1)
    return new_individuals(rng.random((count, 2)), genes, energy)


def child_genes(one: FloatArray, other: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return genes of which each is of one of the parents, mutated, within 0 to 1."""
    inherited = np.where(rng.random(one.shape) < 0.5, one, other)
    genes: FloatArray = np.clip(inherited + MUTATION_SD * rng.standard_normal(one.shape), 0.0, 1.0)
    return genes


def shortest(offset: FloatArray) -> FloatArray:
    """Return offsets the short way round the torus."""
    way: FloatArray = offset - np.round(offset)
    return way


def live(
    population: Population,
    zones: FloatArray,
    steps: int,
    is_mortal: bool,
    on_mating: OnMating,
    rng: np.random.Generator,
) -> None:
    """Let a population live for some steps among zones (Z, 2), as those mortal do who die without energy."""
    population.matings[:] = population.refractory[:] = 0
    population.partner[:] = -1
    population.places[:] = rng.random(population.places.shape)
    population.headings[:] = rng.uniform(-1.0, 1.0, population.headings.shape)
    for _ in range(steps):
        _step(population, zones, is_mortal, on_mating, rng)


def _step(
    population: Population,
    zones: FloatArray,
    is_mortal: bool,
    on_mating: OnMating,
    rng: np.random.Generator,
) -> None:
    is_hungry = population.energies < population.genes[:, THRESHOLD]
    is_ready = population.is_alive & ~is_hungry & (population.refractory == 0)
    nearest, to_mate, mate_distance = _nearest_mates(population, is_ready)
    to_zones = shortest(zones[None] - population.places[:, None])
    zone_distances = np.hypot(to_zones[..., 0], to_zones[..., 1])
    zone = zone_distances.argmin(axis=1)
    rows = np.arange(len(population))
    seeks_mate = is_ready & np.isfinite(mate_distance)
    offset = np.where(seeks_mate[:, None], to_mate, to_zones[rows, zone])
    wanders = population.is_alive & ~seeks_mate & ~is_hungry
    offset[wanders] = population.headings[wanders]
    distance = np.maximum(np.hypot(offset[:, 0], offset[:, 1]), 1e-9)
    speed = HIGHEST_SPEED * population.genes[:, SKILL] * population.is_alive
    population.places += offset * (np.minimum(speed, distance) / distance)[:, None]
    population.places %= 1.0
    gained = ZONE_ENERGY * (zone_distances[rows, zone] < ZONE_RADIUS)
    energies = np.clip(population.energies + gained - STEP_ENERGY, 0.0, 1.0)
    population.energies[:] = np.where(population.is_alive, energies, 0.0)
    if is_mortal:
        population.is_alive &= population.energies > 0.0
    np.maximum(population.refractory - 1, 0, out=population.refractory)
    is_pair = seeks_mate & (mate_distance < CONTACT) & (nearest[nearest] == rows) & (rows < nearest)
    for one in np.flatnonzero(is_pair & seeks_mate[nearest]).tolist():
        other = int(nearest[one])
        for own, mate in ((one, other), (other, one)):
            population.matings[own] += 1
            population.refractory[own] = REFRACTORY_STEPS
            population.partner[own] = mate
            population.headings[own] = rng.uniform(-1.0, 1.0, 2)
        on_mating(one, other)


def _nearest_mates(
    population: Population, is_ready: NDArray[np.bool_]
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return, for each, the nearest one that is ready and was not the last: index, way, and distance, or infinity."""
    ways = shortest(population.places[None] - population.places[:, None])
    distances = np.hypot(ways[..., 0], ways[..., 1])
    rows = np.arange(len(population))
    distances[:, ~is_ready] = np.inf
    distances[rows, rows] = np.inf
    has_mated = population.partner >= 0
    distances[rows[has_mated], population.partner[has_mated]] = np.inf
    nearest = distances.argmin(axis=1)
    return nearest, ways[rows, nearest], distances[rows, nearest]
