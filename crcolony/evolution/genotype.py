"""Genotypes: arrays of named, bounded genes (thesis 4.1), identified by a hash of their content."""

import hashlib
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from crcolony.compiled import FloatArray


class GenotypeError(ValueError):
    """Genes that do not fit their schema; the message names the gene."""


@dataclass(frozen=True)
class Normal:
    """The initial distribution of a gene: normal."""

    mean: float
    sd: float


@dataclass(frozen=True)
class Uniform:
    """The initial distribution of a gene: uniform between two numbers."""

    low: float
    high: float


@dataclass(frozen=True)
class Gene:
    """One real-valued gene: its name, its range, its initial distribution, and the deviation of a
    mutation."""

    name: str
    low: float = -math.inf
    high: float = math.inf
    initial: Normal | Uniform = Normal(0.0, 1.0)
    mutation_sd: float = 0.1


@dataclass(frozen=True)
class Schema:
    """The genes of a species, in order. Robots can mate if their schemas have the same digest.

    Raises ValueError for two genes of one name or an empty range.
    """

    genes: tuple[Gene, ...]

    def __post_init__(self) -> None:
        names = [gene.name for gene in self.genes]
        if len(set(names)) != len(names):
            twice = next(name for name in names if names.count(name) > 1)
            raise ValueError(f"two genes are named {twice}")
        for gene in self.genes:
            if not gene.low <= gene.high:
                raise ValueError(f"gene {gene.name}: empty range {gene.low} to {gene.high}")

    def __len__(self) -> int:
        return len(self.genes)

    @cached_property
    def lows(self) -> FloatArray:
        """Lowest value of every gene, shape (genes,)."""
        return _frozen([gene.low for gene in self.genes])

    @cached_property
    def highs(self) -> FloatArray:
        """Highest value of every gene, shape (genes,)."""
        return _frozen([gene.high for gene in self.genes])

    @cached_property
    def _finite_range(self) -> tuple[FloatArray, FloatArray]:
        """The lowest and highest finite value of every gene, shape (genes,) each."""
        limits = np.finfo(np.float64)
        return np.maximum(self.lows, limits.min), np.minimum(self.highs, limits.max)

    @cached_property
    def mutation_sds(self) -> FloatArray:
        """Standard deviation of a mutation of every gene, shape (genes,)."""
        return _frozen([gene.mutation_sd for gene in self.genes])

    @cached_property
    def text(self) -> str:
        """A line for every gene: its name and its range."""
        return "\n".join(f"{gene.name} {gene.low!r} {gene.high!r}" for gene in self.genes)

    @cached_property
    def digest(self) -> str:
        """A hash of the names and ranges of the genes."""
        return hashlib.blake2b(self.text.encode(), digest_size=16).hexdigest()

    def index(self, name: str) -> int:
        """Return the index of a gene; raises KeyError for an unknown name."""
        for index, gene in enumerate(self.genes):
            if gene.name == name:
                return index
        raise KeyError(name)

    def random(self, rng: np.random.Generator) -> FloatArray:
        """Return genes drawn from their initial distributions, within their ranges, shape
        (genes,)."""
        genes = [
            rng.normal(gene.initial.mean, gene.initial.sd)
            if isinstance(gene.initial, Normal)
            else rng.uniform(gene.initial.low, gene.initial.high)
            for gene in self.genes
        ]
        return np.asarray(np.clip(genes, self.lows, self.highs), dtype=np.float64)

    def validate(self, genes: FloatArray) -> None:
        """Raise GenotypeError if genes have the wrong length, are not finite, or leave their
        range."""
        if genes.shape != (len(self),):
            raise GenotypeError(f"expected {len(self)} genes, got shape {genes.shape}")
        lows, highs = self._finite_range
        valid = (genes >= lows) & (genes <= highs)
        if not valid.all():
            index = int(np.argmin(valid))
            gene = self.genes[index]
            raise GenotypeError(
                f"gene {gene.name}: {genes[index]} is not within {gene.low} to {gene.high}"
            )


@dataclass(frozen=True, eq=False)
class Genotype:
    """Checked, read-only genes; two genotypes are equal if their content is.

    Raises GenotypeError as `Schema.validate` does.
    """

    schema: Schema
    genes: FloatArray

    def __post_init__(self) -> None:
        self.schema.validate(self.genes)
        object.__setattr__(self, "genes", _frozen(self.genes))

    @cached_property
    def digest(self) -> str:
        """The content hash of the genes."""
        return genotype_digest(self.schema, self.genes)

    def __getitem__(self, name: str) -> float:
        return float(self.genes[self.schema.index(name)])

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Genotype) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)


def genotype_digest(schema: Schema, genes: FloatArray) -> str:
    """Return the content hash of genes (genes,): the same for the same numbers under the same
    schema."""
    content = np.ascontiguousarray(genes, dtype="<f8").tobytes()
    return hashlib.blake2b(schema.digest.encode() + content, digest_size=16).hexdigest()


def _frozen(values: list[float] | FloatArray) -> FloatArray:
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array
