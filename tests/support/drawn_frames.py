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

Rows = dict[str, list[dict[str, Any]]]
"""Rows of every entity"""
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
    """The drawings in a recording up to its last flush; `update` reads those that came since."""

    def __init__(self, rrd: Path) -> None:
        self._rrd = rrd
        self._size = -1
        self.frames: list[Frame] = []
        """All drawings of robots, in order"""
        self.mating_lines: list[MatingLines] = []
        """All drawings of mating lines, in order"""

    def update(self) -> bool:
        """Read the recording again if it has grown; return whether there is anything new."""
        size = self._rrd.stat().st_size
        if size == self._size:
            return False
        try:
            rows = read_rows(self._rrd)
        except RuntimeError:  # the last message is not complete yet
            return False
        self._size = size
        self.frames = _frames(rows)
        self.mating_lines = _mating_lines(rows)
        return True


def _frames(rows: Rows) -> list[Frame]:
    rings = {row["wall"]: row["Points2D:colors"] for row in rows.get(f"{ROOT}/energy", [])}
    return [
        Frame(
            row["wall"] / 1e9,
            row["tick"][0],
            [(x, y) for x, y in row["Points2D:positions"]],
            [(c >> 24, c >> 16 & 255, c >> 8 & 255) for c in rings[row["wall"]]],
        )
        for row in rows.get(f"{ROOT}/robots", [])
        if row["tick"] and row["wall"] in rings
    ]


def _mating_lines(rows: Rows) -> list[MatingLines]:
    return [
        MatingLines(
            row["wall"] / 1e9,
            [((x, y), (u, v)) for (x, y), (u, v) in row["LineStrips2D:strips"]],
        )
        for row in rows.get(f"{ROOT}/matings", [])
    ]


def read_rows(rrd: Path) -> Rows:
    """Return the rows of every entity below the arena in order of the wall clock, with times in nanoseconds.

    Raises RuntimeError if the last message is incomplete.
    """
    rows: Rows = {}
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
