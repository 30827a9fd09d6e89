"""Options and checks that several commands share."""

import argparse
from pathlib import Path

from crcolony.errors import CrcolonyError

MAX_MINUTES = 366 * 24 * 60


class UsageError(CrcolonyError):
    """Options that do not go together."""


def add_config(parser: argparse.ArgumentParser) -> None:
    """Add the options that decide the config."""
    parser.add_argument("--config", type=Path, metavar="FILE", help="TOML file; default: built in")
    parser.add_argument("--generations", type=int, metavar="N", help="0: until stopped")
    parser.add_argument("--seed", type=int, metavar="N")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        dest="settings",
        help="any setting of the config, as in --set life.agents=10; may be repeated",
    )


def settings_of(options: argparse.Namespace) -> list[str]:
    """Return the options that are settings as `key=value`, those of --set last."""
    named = [
        f"{name}={getattr(options, name)}"
        for name in ("robots", "generations", "seed", "selection")
        if getattr(options, name, None) is not None
    ]
    return named + list(options.settings)


def check_minutes(minutes: float | None) -> None:
    """Raise UsageError for a time that is none."""
    if minutes is not None and not 0.0 < minutes < MAX_MINUTES:
        raise UsageError(f"--minutes {minutes:g}: must be above 0 and at most a year")


def new_folder() -> Path:
    """Name a folder that does not exist yet: runs/1, runs/2, …"""
    number = 1
    while Path(f"runs/{number}").exists():
        number += 1
    return Path(f"runs/{number}")


def say_if_compiling() -> None:
    """Tell a user at the first start why nothing happens."""
    from crcolony.compiled import is_first_start

    if is_first_start():
        print("the first start compiles the colony, which takes half a minute", flush=True)
