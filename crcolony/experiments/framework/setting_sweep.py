"""Sweeps over settings: every combination of their values is a condition, named by what it sets."""

import itertools
import re
from collections.abc import Sequence
from pathlib import Path

from crcolony.config import Config, ConfigError, load

_COMMA = re.compile(r",(?![^\[]*\])")
"""One that is not within a list."""
_LONGEST_NAME = 200
"""Of a condition, in bytes: it is the name of a folder, too."""


def sweep_conditions(
    file: Path | None, settings: Sequence[str], sweeps: Sequence[str]
) -> dict[str, Config]:
    """Return the config of every combination of `KEY=VALUE,VALUE` by its name; raises ConfigError.

    The last sweep varies fastest. A combination sets its values after `settings` (`key=value`) and those of a file.
    """
    axes = [_axis_of(sweep) for sweep in sweeps]
    keys = [axis[0].partition("=")[0] for axis in axes]
    for key in keys:
        if keys.count(key) > 1:
            raise ConfigError(f"--sweep {key}: is swept twice")
        if key == "seed":
            raise ConfigError("--sweep seed: every condition has the seeds of --seeds")
    conditions: dict[str, Config] = {}
    for values in itertools.product(*axes):
        name = " ".join(values)
        if len(name.encode()) > _LONGEST_NAME or "/" in name:
            raise ConfigError(f"--sweep: {name[:40]}…: cannot be the name of a folder")
        if name in conditions:
            raise ConfigError(f"--sweep: {name}: is there twice")
        conditions[name] = load(file, [*settings, *values])
    return conditions


def _axis_of(sweep: str) -> list[str]:
    """Return a sweep as settings, each with one value."""
    key, equals, text = sweep.partition("=")
    key, values = key.strip(), [value.strip() for value in _COMMA.split(text)]
    if not equals or not key or not all(values):
        raise ConfigError(
            f"--sweep {sweep!r}: expected key=value,value, as in life.energy_per_step=0.001,0.002"
        )
    return [f"{key}={value}" for value in values]
