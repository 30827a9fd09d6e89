"""Options and checks that several commands share."""

import argparse
from pathlib import Path

from crcolony.errors import CrcolonyError

MAX_MINUTES = 366 * 24 * 60
"""A year."""


class UsageError(CrcolonyError):
    """An option has a wrong value, or options exclude each other."""


def add_config(parser: argparse.ArgumentParser) -> None:
    """Add the options that determine the config."""
    parser.add_argument(
        "--config",
        type=Path,
        metavar="FILE",
        help="TOML file with settings; default: built-in settings",
    )
    parser.add_argument(
        "--generations", type=int, metavar="N", help="generations to run; 0: until stopped"
    )
    parser.add_argument("--seed", type=int, metavar="N", help="seed of all random numbers")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        dest="settings",
        help="a setting of the config, as in --set life.agents=10; may be repeated",
    )


def settings_of(options: argparse.Namespace) -> list[str]:
    """Return all options that are settings as `key=value`, those of --set last."""
    named = [
        f"{name}={getattr(options, name)}"
        for name in ("robots", "generations", "seed", "selection")
        if getattr(options, name, None) is not None
    ]
    return named + list(options.settings)


def check_minutes(minutes: float | None) -> None:
    """Raise UsageError for a duration that is not above 0 or longer than a year."""
    if minutes is not None and not 0.0 < minutes < MAX_MINUTES:
        raise UsageError(f"--minutes {minutes:g}: must be above 0 and at most a year")


def new_folder() -> Path:
    """Return the first folder of runs/1, runs/2, … that does not exist yet."""
    number = 1
    while Path(f"runs/{number}").exists():
        number += 1
    return Path(f"runs/{number}")


def print_if_compiling() -> None:
    """Print a notice if this is the first start, which takes longer."""
    from crcolony.compiled import is_first_start

    if is_first_start():
        print("the first start compiles the colony, which takes half a minute", flush=True)
