"""The genes of a virtual agent: selector, meta-parameters and potentials (thesis 3.2, 3.3, 5.3).

Genes are read straight from the genotype: the compiled step reads the same array that evolution
varies.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from crcolony.compiled import FloatArray
from crcolony.evolution.genotype import Gene, Normal, Schema, Uniform
from crcolony.robot.modules import MODULES, LearningModule
from crcolony.robot.settings import Heredity, Learning

META_PARAMETERS = ("alpha", "gamma", "lambda", "tau", "tau_decay")
ALPHA, GAMMA, LAMBDA, TAU, TAU_DECAY = range(len(META_PARAMETERS))
"""Indices of a module's meta-parameters, counted from its first gene."""

POTENTIAL = len(META_PARAMETERS)
"""Index of the first weight of its potential, which follow them."""


def selector_inputs(modules: Sequence[LearningModule] = MODULES) -> tuple[str, ...]:
    """Return the names of the inputs of the selector network."""
    return ("bias", "energy", *(f"{module.name}_target_visible" for module in modules))


def agent_schema(
    learning: Learning, heredity: Heredity, modules: Sequence[LearningModule] = MODULES
) -> Schema:
    """Return the genes of an agent: selector weights of all modules but the first, then each
    module's own genes."""
    genes: list[Gene] = []
    highest_selector = heredity.highest_selector or math.inf
    for module in modules[1:]:
        genes += [
            Gene(
                f"selector.{module.name}.{source}",
                low=-highest_selector,
                high=highest_selector,
                initial=Normal(0.0, heredity.selector_sd),
                mutation_sd=heredity.selector_mutation_sd,
            )
            for source in selector_inputs(modules)
        ]
    for module in modules:
        genes += _meta_genes(module.name, heredity) + _potential_genes(
            module.name, learning, heredity
        )
    return Schema(tuple(genes))


def _meta_genes(name: str, heredity: Heredity) -> list[Gene]:
    highest = (
        heredity.highest_alpha,
        heredity.highest_gamma,
        heredity.highest_lambda,
        heredity.highest_tau,
        heredity.highest_tau_decay,
    )
    deviations = {"tau_decay": heredity.tau_decay_mutation_sd}
    return [
        Gene(
            f"{name}.{meta}",
            low=0.0,
            high=high,
            initial=Uniform(0.0, high),
            mutation_sd=deviations.get(meta, heredity.meta_mutation_sd),
        )
        for meta, high in zip(META_PARAMETERS, highest, strict=True)
    ]


def _potential_genes(name: str, learning: Learning, heredity: Heredity) -> list[Gene]:
    sd = heredity.potential_sd if learning.shaping else 0.0
    mutation_sd = heredity.potential_mutation_sd if learning.shaping else 0.0
    return [
        Gene(f"{name}.potential.{k}", initial=Normal(0.0, sd), mutation_sd=mutation_sd)
        for k in range(learning.potential_distances * learning.potential_bearings)
    ]


@dataclass(frozen=True)
class MetaParameters:
    """The meta-parameters of a module's learning (thesis 3.3)."""

    alpha: float
    gamma: float
    lambda_: float
    tau: float
    tau_decay: float


@dataclass(frozen=True)
class VirtualAgent:
    """A decoded genotype, for display and tests: selector weights and each module's learning
    ability."""

    selector: FloatArray
    """(outputs, inputs) weights"""
    meta_parameters: tuple[MetaParameters, ...]
    """One for every module"""
    potentials: tuple[FloatArray, ...]
    """(distances, bearings) weights of every module's potential"""


def decode(
    genes: FloatArray, learning: Learning, modules: Sequence[LearningModule] = MODULES
) -> VirtualAgent:
    """Decode a genotype as the compiled step reads it."""
    inputs = len(selector_inputs(modules))
    outputs = len(modules) - 1
    width = module_genes(learning)
    shape = (learning.potential_distances, learning.potential_bearings)
    own = [genes[outputs * inputs + m * width :][:width] for m in range(len(modules))]
    return VirtualAgent(
        selector=genes[: outputs * inputs].reshape(outputs, inputs),
        meta_parameters=tuple(MetaParameters(*gene[:POTENTIAL].tolist()) for gene in own),
        potentials=tuple(gene[POTENTIAL:].reshape(shape) for gene in own),
    )


def module_genes(learning: Learning) -> int:
    """Return how many genes a module has."""
    return POTENTIAL + learning.potential_distances * learning.potential_bearings
