"""The short form of the table of claims: how many of each experiment reproduce, between two marks of a page."""

from collections import Counter
from collections.abc import Sequence

from crcolony.errors import CrcolonyError
from crcolony.experiments.framework.catalogue import summaries
from crcolony.experiments.framework.claims_table import (
    TableRow,
    by_experiment,
    command_of,
    count_verdicts,
)

BEGIN, END = "<!-- made by crcolony claims -->", "<!-- end of the claims -->"


class SummaryError(CrcolonyError):
    """A page has no place for the short form: the message says what is missing."""


def format_summary(rows: Sequence[TableRow]) -> list[str]:
    """Return the short form as lines of Markdown."""
    lines = [
        "| what | claims | reproduced | in part | not | command |",
        "|---|---|---|---|---|---|",
    ]
    for name, own in by_experiment(rows).items():
        counts = Counter(row.measured.verdict for row in own)
        lines.append(
            f"| {summaries()[name].summary} | {len(own)} | {counts['reproduced']} | {counts['partly']}"
            f" | {counts['not']} | `{command_of(own[0].description)}` |"
        )
    return [*lines, "", f"Of {len(rows)} claims: {count_verdicts(rows)}."]


def with_summary(page: str, rows: Sequence[TableRow]) -> str:
    """Return a page with the short form between its marks; raises SummaryError if it has not both, once each."""
    if page.count(BEGIN) != 1 or page.count(END) != 1 or page.index(BEGIN) > page.index(END):
        raise SummaryError(
            f"there is no place for the short form: a line {BEGIN}, and {END} after it"
        )
    before, _, rest = page.partition(BEGIN)
    after = rest.partition(END)[2]
    return "\n".join([f"{before}{BEGIN}", *format_summary(rows), f"{END}{after}"])
