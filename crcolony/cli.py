"""The command line `crcolony`. Commands import heavy modules only when they run, so that `--help` answers at once."""

import argparse
import os
import sys
from collections.abc import Sequence
from typing import NoReturn

from crcolony.commands.arena import add_arena
from crcolony.commands.check import add_check
from crcolony.commands.dashboard import add_dashboard
from crcolony.commands.evolve import add_evolve
from crcolony.commands.export import add_export
from crcolony.commands.host import add_host
from crcolony.commands.inspect import add_inspect
from crcolony.commands.keygen import add_keygen
from crcolony.commands.launch import add_launch
from crcolony.commands.plot import add_plot
from crcolony.commands.replay import add_replay
from crcolony.commands.robot import add_robot
from crcolony.commands.router import add_router
from crcolony.commands.simulate import add_simulate
from crcolony.commands.status import add_status
from crcolony.commands.top import add_top
from crcolony.errors import (
    EXIT_FATAL,
    EXIT_INTERRUPTED,
    EXIT_UNREAD,
    EXIT_WRONG_INPUT,
    CrcolonyError,
    FatalStorageError,
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code (see `crcolony.errors`); a CrcolonyError is printed in one line."""
    options = _parser().parse_args(arguments)
    try:
        code: int = options.command(options)
    except (ImportError, CrcolonyError) as error:
        print(f"crcolony: {error}", file=sys.stderr)
        return EXIT_WRONG_INPUT
    except FatalStorageError as error:
        print(f"crcolony: {error}", file=sys.stderr)
        return EXIT_FATAL
    except KeyboardInterrupt:
        print("crcolony: interrupted", file=sys.stderr)
        return EXIT_INTERRUPTED
    except BrokenPipeError:  # the reader of our output is gone, as in `crcolony evolve | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_UNREAD
    return code


class _Parser(argparse.ArgumentParser):
    """Prints errors of the options in one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(EXIT_WRONG_INPUT, f"{self.prog}: {message} (see {self.prog} --help)\n")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="crcolony",
        description="A colony of robots that evolves how to learn, with nobody in charge.",
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for name, add_options, summary in (
        ("evolve", add_evolve, "evolve an in-process colony on this machine"),
        ("launch", add_launch, "start an arena and robots, each its own process"),
        ("arena", add_arena, "run an arena that robots of any machine can join"),
        ("robot", add_robot, "run one robot"),
        ("host", add_host, "run an arena and many robots in one process"),
        ("router", add_router, "run a Zenoh router, for colonies too large for a mesh of peers"),
        ("simulate", add_simulate, "test colonies in virtual time with injected faults"),
        ("dashboard", add_dashboard, "show colonies live in Rerun"),
        ("replay", add_replay, "show a finished run in the dashboard"),
        ("export", add_export, "export recorded telemetry as Parquet tables"),
        ("top", add_top, "show the robots that are online and their state, live"),
        ("status", add_status, "print the robots that are online and their state, once"),
        ("inspect", add_inspect, "print what is in a robot's file"),
        ("keygen", add_keygen, "generate a robot's key"),
        ("check", add_check, "validate a config file"),
        ("plot", add_plot, "draw figures of a run, or of many runs with intervals over seeds"),
    ):
        add_options(commands.add_parser(name, help=summary, description=summary))
    return parser
