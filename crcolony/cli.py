"""The command line. Heavy imports wait until a command needs them, so that `--help` answers at once."""

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
    EXIT_BROKEN,
    EXIT_INTERRUPTED,
    EXIT_UNREAD,
    EXIT_WRONG_INPUT,
    Broken,
    CrcolonyError,
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; return its exit code, as `errors.py` has them. What is wrong outside is said in one line."""
    options = _parser().parse_args(arguments)
    try:
        code: int = options.command(options)
    except (ImportError, CrcolonyError) as error:
        print(f"crcolony: {error}", file=sys.stderr)
        return EXIT_WRONG_INPUT
    except Broken as error:
        print(f"crcolony: {error}", file=sys.stderr)
        return EXIT_BROKEN
    except KeyboardInterrupt:
        print("crcolony: interrupted", file=sys.stderr)
        return EXIT_INTERRUPTED
    except BrokenPipeError:  # whoever read our output is gone, as in `crcolony evolve | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_UNREAD
    return code


class _Parser(argparse.ArgumentParser):
    """Says what is wrong with the options in one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(EXIT_WRONG_INPUT, f"{self.prog}: {message} (see {self.prog} --help)\n")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="crcolony",
        description="A colony of robots that evolves how to learn, with nobody in charge.",
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for name, add, what in (
        ("evolve", add_evolve, "evolve an embedded colony on this machine"),
        ("launch", add_launch, "start an arena and robots, each its own process"),
        ("arena", add_arena, "run an arena, which robots of any machine may join"),
        ("robot", add_robot, "run one robot"),
        ("host", add_host, "run an arena and many robots in one process"),
        ("router", add_router, "run a router for more robots than a mesh carries"),
        ("simulate", add_simulate, "colonies in virtual time, with everything going wrong"),
        ("dashboard", add_dashboard, "watch colonies live in Rerun"),
        ("replay", add_replay, "the same dashboard from a finished run"),
        ("export", add_export, "recorded telemetry as Parquet tables"),
        ("top", add_top, "who is alive, and how they are, live"),
        ("status", add_status, "the same, once"),
        ("inspect", add_inspect, "look into a robot's memory"),
        ("keygen", add_keygen, "make a robot's key"),
        ("check", add_check, "validate a config file"),
        ("plot", add_plot, "figures of a run, or of many with bands over seeds"),
    ):
        add(commands.add_parser(name, help=what))
    return parser
