"""The genes of a species (PROTOCOL.md, "Schema"): their names and ranges, how they are drawn and how they cross."""

import math
import random
from hashlib import blake2b
from typing import Final, NamedTuple

from tests.foreign.messages import numbers, packed

MUTATED_PART: Final = 0.1
MUTATION: Final = 0.05


class Gene(NamedTuple):
    name: str
    low: float
    high: float

    def clipped(self, value: float) -> float:
        return max(self.low, min(self.high, value))

    def drawn(self, luck: random.Random) -> float:
        if math.isinf(self.high - self.low):
            return self.clipped(luck.gauss(0.0, 0.5))
        return luck.uniform(self.low, self.high)

    def mutated(self, value: float, luck: random.Random) -> float:
        width = 1.0 if math.isinf(self.high - self.low) else self.high - self.low
        return self.clipped(value + luck.gauss(0.0, MUTATION * width))


class Species(NamedTuple):
    genes: tuple[Gene, ...]

    @property
    def lines(self) -> str:
        return "\n".join(f"{gene.name} {gene.low!r} {gene.high!r}" for gene in self.genes)

    @property
    def digest(self) -> bytes:
        return blake2b(self.lines.encode(), digest_size=16).digest()

    def has(self, genes: bytes) -> bool:
        """Whether these are genes of the species: as many, finite, each in its range."""
        if len(genes) != 8 * len(self.genes):
            return False
        pairs = zip(self.genes, numbers(genes), strict=True)
        return all(math.isfinite(value) and gene.low <= value <= gene.high for gene, value in pairs)

    def drawn(self, luck: random.Random) -> bytes:
        return packed(tuple(gene.drawn(luck) for gene in self.genes))

    def crossed(self, mother: bytes, father: bytes, luck: random.Random) -> bytes:
        """Of each gene the mother's or the father's, some of them mutated."""
        child = []
        for gene, one, other in zip(self.genes, numbers(mother), numbers(father), strict=True):
            value = luck.choice((one, other))
            child.append(gene.mutated(value, luck) if luck.random() < MUTATED_PART else value)
        return packed(tuple(child))


def species(lines: str) -> Species:
    """Of one line a gene: its name, its lowest and its highest value. Raises ValueError."""
    genes = []
    for line in lines.splitlines():
        name, low, high = line.rsplit(" ", 2)
        genes.append(Gene(name, float(low), float(high)))
    if not genes or not all(gene.low <= gene.high for gene in genes):
        raise ValueError("no genes, or no ranges")
    return Species(tuple(genes))
