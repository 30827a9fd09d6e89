"""What a dashboard has drawn of the arena, read from its recording (.rrd) while it is being written."""

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
from crcolony_dashboards.tabs.arena_layout import ROOT
from crcolony_dashboards.tabs.palette import Colour
from rerun.chunk import RrdReader

Line = tuple[tuple[float, float], tuple[float, float]]
"""The two ends of a line (m)"""


@dataclass(frozen=True)
class Frame:
    """The robots as they were drawn at one moment."""

    unix_s: float
    tick: int
    """Of the scene that was drawn"""
    positions: list[tuple[float, float]]
    """In the order of the scene (m)"""
    rings: list[Colour]


@dataclass(frozen=True)
class MatingLines:
    """The lines between robots that have just mated, from one moment until the next drawing of such lines."""

    unix_s: float
    lines: list[Line]


class DrawnFrames:
    """The drawings in a recording; it is read again when it has grown."""

    def __init__(self, rrd: Path) -> None:
        self._rrd = rrd
        self._size = -1
        self._rows: dict[str, list[dict[str, Any]]] = {}

    def frames(self) -> list[Frame]:
        """Return all drawings of robots so far, in order; only their last flush, some seconds ago, is included."""
        rings = {row["wall"]: row["Points2D:colors"] for row in self._read("energy")}
        return [
            Frame(
                row["wall"] / 1e9,
                row["tick"][0],
                [(x, y) for x, y in row["Points2D:positions"]],
                [(c >> 24, c >> 16 & 255, c >> 8 & 255) for c in rings[row["wall"]]],
            )
            for row in self._read("robots")
            if row["tick"] and row["wall"] in rings
        ]

    def mating_lines(self) -> list[MatingLines]:
        """Return all drawings of mating lines so far, in order."""
        return [
            MatingLines(
                row["wall"] / 1e9,
                [((x, y), (u, v)) for (x, y), (u, v) in row["LineStrips2D:strips"]],
            )
            for row in self._read("matings")
        ]

    def _read(self, entity: str) -> list[dict[str, Any]]:
        size = self._rrd.stat().st_size
        if size != self._size:
            self._size, self._rows = size, read_rows(self._rrd)
        return self._rows.get(f"{ROOT}/{entity}", [])


def read_rows(rrd: Path) -> dict[str, list[dict[str, Any]]]:
    """Return the rows of every entity below the arena in order of the wall clock, with times in nanoseconds."""
    rows: dict[str, list[dict[str, Any]]] = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a recording has no footer before it is complete
        for chunk in RrdReader(rrd).stream():
            batch = chunk.to_record_batch()
            if not str(chunk.entity_path).startswith(ROOT) or "wall" not in batch.schema.names:
                continue
            names = [name for name in batch.schema.names if ":" in name or name == "tick"]
            walls = batch.column("wall").cast(pa.int64()).to_pylist()
            values = batch.select(names).to_pylist()
            found = rows.setdefault(str(chunk.entity_path), [])
            found += [{"wall": wall, **row} for wall, row in zip(walls, values, strict=True)]
    return {path: sorted(found, key=lambda row: int(row["wall"])) for path, found in rows.items()}


def is_near(one: Line, other: Line, tolerance_m: float = 1e-3) -> bool:
    """Return whether two lines have the same ends, in either order."""
    first, second = np.array(one), np.array(other)
    gaps = (np.abs(first - second).max(), np.abs(first - second[::-1]).max())
    return bool(min(gaps) < tolerance_m)
