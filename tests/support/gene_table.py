"""The genes of the default species as the table of PROTOCOL.md: `python -m tests.support.gene_table` prints it."""

from itertools import groupby

from crcolony.config import Config
from crcolony.evolution.genotype import Gene
from crcolony.robot.genes import agent_schema

DEFAULT_SCHEMA = agent_schema(Config().learning, Config().heredity)


def format_table() -> str:
    """Return a row for every gene, and one for genes of the same range that are numbered."""
    lines = ["| gene | name | low | high |", "|---|---|---|---|"]
    numbered = enumerate(DEFAULT_SCHEMA.genes)
    for _, group in groupby(numbered, key=lambda item: _kind(*item)):
        genes = list(group)
        (first, one), (last, other) = genes[0], genes[-1]
        places = f"{first}" if first == last else f"{first} to {last}"
        names = f"`{one.name}`" if first == last else f"`{one.name}` to `{other.name}`"
        lines.append(f"| {places} | {names} | `{one.low!r}` | `{one.high!r}` |")
    return "\n".join(lines)


def _kind(place: int, gene: Gene) -> tuple[str, float, float]:
    stem, _, number = gene.name.rpartition(".")
    return (stem if number.isdecimal() else gene.name), gene.low, gene.high


if __name__ == "__main__":
    print(format_table())
