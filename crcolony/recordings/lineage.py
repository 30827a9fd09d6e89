"""Who descended from whom, as a phylogeny in the ALife data standard (https://alife-data-standards.github.io).

One row an agent, in the order of births: `id`, `ancestor_list` (mother and father; `[none]` for founders),
`origin_time` and `destruction_time` in ticks (`inf` while it is there). Other columns are ours.
"""

import csv
import io
from collections.abc import Iterable
from pathlib import Path

from crcolony.durable_files import replace_file
from crcolony.evolution.history import Born, Died, Event, Lived
from crcolony.recordings.past_run import PastRunError, read_history

LINEAGE_FILE = "phylogeny.csv"
"""Named for what the standard has in it."""
_COLUMNS = (
    "id",
    "ancestor_list",
    "origin_time",
    "destruction_time",
    "agent",
    "robot",
    "generation",
    "genotype",
    "starved_time",
    "matings",
    "captures",
    "mean_energy",
)


def write_lineage(history: Path, out: Path) -> Path:
    """Write the lineage of a run's history into a folder; return the file. Raises PastRunError."""
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, _COLUMNS, restval="")
    writer.writeheader()
    writer.writerows(lineage_of(read_history(history)))
    path = out / LINEAGE_FILE
    try:
        out.mkdir(parents=True, exist_ok=True)
        replace_file(path, lambda file: file.write(text.getvalue().encode()))
    except OSError as error:
        raise PastRunError(f"{path}: cannot be written: {error.strerror}") from None
    return path


def lineage_of(events: Iterable[Event]) -> list[dict[str, object]]:
    """Return a row for every agent that was born; parents of an earlier run, which are no rows, are left out."""
    rows: dict[str, dict[str, object]] = {}
    for event in events:
        match event:
            case Born():
                parents = dict.fromkeys((event.mother, event.father))
                known = [str(rows[name]["id"]) for name in parents if name in rows]
                rows[event.agent] = {
                    "id": len(rows),
                    "ancestor_list": f"[{','.join(known) or 'none'}]",
                    "origin_time": event.tick,
                    "destruction_time": "inf",
                    "agent": event.agent,
                    "robot": event.robot,
                    "generation": event.generation,
                    "genotype": event.genotype,
                }
            case Died() if event.agent in rows:
                rows[event.agent]["starved_time"] = event.tick
            case Lived() if event.agent in rows:
                rows[event.agent] |= {
                    "destruction_time": event.tick,
                    "matings": event.matings,
                    "captures": event.captures,
                    "mean_energy": event.energy,
                }
    return list(rows.values())
