"""Options and checks that several commands share."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from crcolony.errors import CrcolonyError

if TYPE_CHECKING:
    from crcolony.config import Config

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
    setting = parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        dest="settings",
        help="a setting of the config, as in --set life.agents=10; may be repeated",
    )
    setting.completer = _complete_setting  # type: ignore[attr-defined]


def _complete_setting(**_: object) -> list[str]:
    """Return what --set can begin with (called by argcomplete)."""
    from crcolony.config import is_group, setting_types

    return [f"{key}=" for key, kind in setting_types() if not is_group(kind)]


def add_examples(parser: argparse.ArgumentParser, *examples: tuple[str, str]) -> None:
    """End the help of a command with examples: command lines, and what each is for."""
    lines = "".join(f"\n  {line}\n      {purpose}" for line, purpose in examples)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.epilog = f"examples:{lines}"


def add_log_format(parser: argparse.ArgumentParser, *names: str) -> None:
    """Add the option for how a long-running command prints; `names` are options that say which process it is."""
    parser.add_argument(
        "--log-format",
        choices=("lines", "json"),
        help="print lines for people, or JSON objects, one a line; default: lines, or the"
        " environment variable CRCOLONY_LOG_FORMAT",
    )
    parser.set_defaults(log_names=names)


def settings_of(options: argparse.Namespace) -> list[str]:
    """Return all options that are settings as `key=value`, those of --set last."""
    named = [
        f"{name}={getattr(options, name)}"
        for name in ("robots", "generations", "seed", "selection")
        if getattr(options, name, None) is not None
    ]
    return named + list(options.settings)


def load_config(file: Path | None, settings: Sequence[str]) -> "Config":
    """Return the config of a file with settings; print what is possible in it, but hardly meant. Raises ConfigError."""
    from crcolony.config import load, warnings_of

    config = load(file, settings)
    for warning in warnings_of(config):
        print(f"{file}: {warning}" if file else warning, flush=True)
    return config


def add_no_plots(parser: argparse.ArgumentParser) -> None:
    """Add the option that leaves out the figures at the end, which take some seconds."""
    parser.add_argument(
        "--no-plots",
        action="store_false",
        dest="has_plots",
        help="draw no figures at the end; crcolony plot draws them later",
    )


def check_minutes(minutes: float | None) -> None:
    """Raise UsageError for a duration that is not above 0 or longer than a year."""
    if minutes is not None and not 0.0 < minutes < MAX_MINUTES:
        raise UsageError(f"--minutes {minutes:g}: must be above 0 and at most a year")


def print_if_compiling() -> None:
    """Print a notice if this is the first start, which takes longer."""
    from crcolony.compiled import is_first_start

    if is_first_start():
        print("the first start compiles the colony, which takes about a minute", flush=True)
