"""The runs of some folders, grouped into conditions: runs of the same settings, which differ by chance alone."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from crcolony.config import Config, ConfigError, load
from crcolony.errors import CrcolonyError
from crcolony.results.generation_summary import QUANTILES, quantile_name
from crcolony.results.generation_table import GENERATION_TABLE, read_table
from crcolony.results.plots.bands import MIN_RUNS, Band, Table, band_of
from crcolony.robot.genes import META_PARAMETERS
from crcolony.robot.modules import MODULES
from crcolony.storage.files import FolderError

_MEANS = ("generation", "matings", "conceptions", "captures", "energy", "starved", "lived_steps")
_MAX_DIFFERENCES = 3
"""Conditions that differ in more settings are named by their folders."""


class PlotError(CrcolonyError):
    """The figures cannot be drawn: the message says why."""


@dataclass(frozen=True)
class Run:
    """The results of one run."""

    folder: Path
    config: Config
    table: Table


@dataclass(frozen=True)
class Condition:
    """Runs of the same settings, and a name that tells them from other conditions (empty if there are none)."""

    name: str
    runs: tuple[Run, ...]

    def band(self, column: str) -> Band:
        """Return a column's mean over the runs, with its band."""
        return band_of([run.table for run in self.runs], column)

    @property
    def config(self) -> Config:
        """The config of all its runs, but for the seed and the number of generations."""
        return self.runs[0].config

    @property
    def label(self) -> str:
        """The text in a legend: the name and the number of runs that are drawn."""
        count = self.band("matings").count
        runs = f"{count.max()} runs" if count.max() > 1 else f"1 run, seed {self.config.seed}"
        if count.min() < count.max():
            runs = f"{count.min()} to {runs}"
        return f"{self.name} ({runs})" if self.name else runs

    def describe(self) -> str:
        """Return a line with the number of runs and the generations that are drawn."""
        drawn = self.band("matings").generation
        furthest = max(run.table["generation"][-1] for run in self.runs)
        text = f"{self.label}: generations {drawn[0]:.0f} to {drawn[-1]:.0f}"
        if furthest > drawn[-1]:
            text += f"; fewer than {min(len(self.runs), MIN_RUNS)} runs reach {furthest:.0f}"
        return text


def read_conditions(folders: Sequence[Path]) -> tuple[Condition, ...]:
    """Read runs and group them by their settings; a folder is that of a run, or of a comparison (CONDITION/seed-N).

    The seed and the number of generations make no difference. The conditions of a comparison have the names of its
    folders, others are named by the settings in which they differ. Raises PlotError for a folder or file that is
    missing or damaged, and for a run that is there twice.
    """
    try:
        found = [run for folder in folders for run in _runs_in(folder)]
        conditions = _grouped([_read_run(folder) for folder in found])
    except (ConfigError, FolderError) as error:
        raise PlotError(str(error)) from None
    except OSError as error:
        raise PlotError(f"{error.filename}: cannot be read: {error.strerror}") from None
    names = [runs[0].folder.parent.name.replace("-", " ") for runs in conditions]
    if not set(found).isdisjoint(folders) or len(set(names)) < len(names):
        return tuple(map(Condition, _differences(conditions), conditions))
    by_name = sorted(
        map(Condition, names, conditions), key=lambda condition: _distance(condition.config)
    )
    return tuple(by_name)  # the baseline comes first: it is nearest to the default settings


def _runs_in(folder: Path) -> list[Path]:
    """Return the folder itself if it is that of a run, or those of a comparison's runs that have ended a generation."""
    if not folder.is_dir():
        raise PlotError(f"{folder}: there is no such folder")
    if (folder / "config.toml").exists():
        return [folder]
    runs = sorted(path.parent for path in folder.glob("*/seed-*/config.toml"))
    if not runs:
        raise PlotError(
            f"{folder}: neither a run (config.toml) nor a comparison (CONDITION/seed-N/config.toml)"
        )
    begun = [run for run in runs if (run / GENERATION_TABLE).exists()]
    if not begun:
        raise PlotError(f"{folder}: no generation has ended yet, there is nothing to draw")
    return begun


def _read_run(folder: Path) -> Run:
    return Run(folder, load(folder / "config.toml"), _read_table(folder / GENERATION_TABLE))


def _read_table(path: Path) -> Table:
    rows = read_table(path)
    if not rows:
        raise PlotError(f"{path}: no generation has ended yet, there is nothing to draw")
    names = [name for name in rows[0] if name is not None]
    missing = [name for name in _columns() if name not in names]
    if missing:
        raise PlotError(f"{path}: corrupt: no column {missing[0]}")
    if any(None in row or None in row.values() for row in rows):
        raise PlotError(f"{path}: corrupt: a row is not as long as the header")
    if not path.read_bytes().endswith(b"\n"):  # a last number that is cut short is a number, too
        raise PlotError(f"{path}: corrupt: the last row is half-written")
    try:
        table = {name: np.array([float(row[name]) for row in rows]) for name in names}
    except ValueError:
        raise PlotError(f"{path}: corrupt: a row is not made of numbers") from None
    if not all(np.isfinite(column).all() for column in table.values()):
        raise PlotError(f"{path}: corrupt: a number is not finite")
    if not (np.diff(table["generation"]) > 0).all():
        raise PlotError(f"{path}: corrupt: generations are not in order")
    return table


def _columns() -> list[str]:
    """Return the names of the columns that are drawn."""
    genes = [f"{module.name}.{meta}" for module in MODULES for meta in META_PARAMETERS]
    return [*_MEANS, *(quantile_name(gene, share) for gene in genes for share in QUANTILES)]


def _grouped(runs: Sequence[Run]) -> list[tuple[Run, ...]]:
    """Group runs of the same settings, in the order in which they come."""
    conditions: dict[Config, tuple[Run, ...]] = {}
    for run in runs:
        setting = msgspec.structs.replace(run.config, seed=0, generations=0)
        others = conditions.get(setting, ())
        _check_not_twice(run, others)
        conditions[setting] = (*others, run)
    for alike in conditions.values():
        if not band_of([run.table for run in alike], "matings").count.size:
            raise PlotError(
                f"{alike[0].folder}: has no generation in common with the other runs of its settings"
            )
    return list(conditions.values())


def _check_not_twice(run: Run, others: Sequence[Run]) -> None:
    """Raise PlotError for a run that is among the others, or a copy of one: the band would be too narrow."""
    for other in others:
        if all(run.table[name][0] == other.table[name][0] for name in _columns()):
            raise PlotError(f"{run.folder}: the same run as {other.folder}")


def _differences(conditions: Sequence[Sequence[Run]]) -> list[str]:
    """Name each condition by the settings in which they differ; if these are several, by those not default."""
    settings = [_settings(runs[0].config) for runs in conditions]
    keys = [key for key in settings[0] if any(each[key] != settings[0][key] for each in settings)]
    if len(keys) > 1:
        defaults = _settings(Config())
        shown = [[key for key in keys if each[key] != defaults[key]] for each in settings]
    else:
        shown = [keys for _ in settings]
    if max(map(len, shown)) > _MAX_DIFFERENCES:
        return [str(runs[0].folder) for runs in conditions]
    names = [
        ", ".join(f"{key} = {_format_toml(each[key])}" for key in own)
        for own, each in zip(shown, settings, strict=True)
    ]
    return [name or "baseline" for name in names] if len(conditions) > 1 else names


def _distance(config: Config) -> int:
    """Count the settings that are not the defaults."""
    own, defaults = _settings(config), _settings(Config())
    return sum(own[key] != defaults[key] for key in own)


def _settings(config: Config) -> dict[str, Any]:
    """Return all settings that make a condition by their full names, as in `life.agents`."""
    settings = _flat(msgspec.to_builtins(config))
    del settings["seed"], settings["generations"]
    return settings


def _flat(tree: Mapping[str, Any], group: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in tree.items():
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{group}{name}.")
        else:
            flat[group + name] = value
    return flat


def _format_toml(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
