"""`crcolony config`: print the effective settings, with their meaning, unit and range."""

import argparse

from crcolony.commands.options import add_config, add_examples, settings_of
from crcolony.errors import EXIT_OK


def add_config_command(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony config`."""
    add_config(parser)
    parser.add_argument(
        "-n", "--robots", type=int, metavar="N", help="robots in the arena (default 4)"
    )
    parser.set_defaults(command=_config)
    add_examples(
        parser,
        ("crcolony config > my.toml", "all settings, to be edited and used with --config my.toml"),
        ("crcolony config --config my.toml --set life.agents=10", "what would be in effect"),
    )


def _config(options: argparse.Namespace) -> int:
    from crcolony.commands.commented_config import commented_toml
    from crcolony.config import load

    print(commented_toml(load(options.config, settings_of(options))), end="")
    return EXIT_OK
