"""The command line `crcolony`. Commands import heavy modules only when they run, so that `--help` answers at once."""

import argparse
import contextlib
import errno
import os
import re
import sys
from collections.abc import Sequence
from typing import Any, NoReturn

from crcolony.commands.arena import add_arena
from crcolony.commands.audit import add_audit
from crcolony.commands.authority import add_authority
from crcolony.commands.backup import add_backup
from crcolony.commands.bridge import add_bridge
from crcolony.commands.check import add_check
from crcolony.commands.claims import add_claims
from crcolony.commands.compile import add_compile
from crcolony.commands.completion import add_completion
from crcolony.commands.config import add_config_command
from crcolony.commands.dashboard import add_dashboard
from crcolony.commands.demo import add_demo
from crcolony.commands.deploy import add_deploy
from crcolony.commands.doctor import add_doctor
from crcolony.commands.enroll import add_enroll
from crcolony.commands.estop import add_estop
from crcolony.commands.evolve import add_evolve
from crcolony.commands.experiment import add_experiment
from crcolony.commands.export import add_export
from crcolony.commands.host import add_host
from crcolony.commands.inspect import add_inspect
from crcolony.commands.keygen import add_keygen
from crcolony.commands.launch import add_launch
from crcolony.commands.metrics import add_metrics
from crcolony.commands.options import UsageError
from crcolony.commands.plot import add_plot
from crcolony.commands.replay import add_replay
from crcolony.commands.restore import add_restore
from crcolony.commands.robot import add_robot
from crcolony.commands.router import add_router
from crcolony.commands.simulate import add_simulate
from crcolony.commands.status import add_status
from crcolony.commands.top import add_top
from crcolony.errors import (
    EXIT_FATAL,
    EXIT_INTERRUPTED,
    EXIT_OK,
    EXIT_UNREAD,
    EXIT_WRONG_INPUT,
    CrcolonyError,
    FatalStorageError,
    did_you_mean,
)
from crcolony.json_log import FORMATS, LOG_FORMAT, JsonLines, json_output
from crcolony.shutdown import end_with_parent
from crcolony.terminal import one_line, standard_streams

COMMANDS = (
    ("demo", add_demo, "evolve for some seconds, then live as processes, with a dashboard"),
    ("evolve", add_evolve, "evolve an in-process colony on this machine"),
    ("experiment", add_experiment, "reproduce a result of the thesis, each claim with a statistic"),
    ("claims", add_claims, "make the table of claims from the results of experiments"),
    ("launch", add_launch, "start an arena and robots, each its own process"),
    ("arena", add_arena, "run an arena that robots of any machine can join"),
    ("robot", add_robot, "run one robot"),
    ("bridge", add_bridge, "attach physical robots, so that robots can live in them"),
    ("estop", add_estop, "stop all bodies at once, and release them"),
    ("host", add_host, "run an arena and many robots in one process"),
    ("router", add_router, "run a Zenoh router, for colonies too large for a mesh of peers"),
    ("authority", add_authority, "admit the members of a deployment, and revoke them"),
    ("enroll", add_enroll, "get the credentials of a member of a deployment"),
    ("simulate", add_simulate, "test colonies in virtual time with injected faults"),
    ("dashboard", add_dashboard, "show colonies live in Rerun"),
    ("replay", add_replay, "show a finished run in the dashboard"),
    ("export", add_export, "export telemetry as Parquet tables, and the lineage of a run"),
    ("compile", add_compile, "compile what robots and arenas need, ahead of their first start"),
    ("deploy", add_deploy, "check an inventory of hosts, and collect what they install"),
    ("doctor", add_doctor, "say what is wrong on this host, and the remedy"),
    ("top", add_top, "show the robots that are online and their state, live"),
    ("status", add_status, "print the robots that are online and their state, once"),
    ("metrics", add_metrics, "export the state of colonies as metrics, for Prometheus"),
    ("inspect", add_inspect, "print what is in a robot's file, or in a results folder"),
    ("backup", add_backup, "copy robots' folders into an archive, while the robots run"),
    ("restore", add_restore, "write a backup of robots' folders into a new folder"),
    ("audit", add_audit, "check or print the log of what operators did"),
    ("keygen", add_keygen, "generate a robot's key"),
    ("config", add_config_command, "print all settings, with meaning, unit and range, as TOML"),
    ("check", add_check, "validate a config file"),
    ("plot", add_plot, "draw figures of a run, or of many runs with intervals over seeds"),
    ("completion", add_completion, "print what makes a shell complete commands and options"),
)


LOGGING = ("launch", "arena", "robot", "bridge", "host", "router", "dashboard", "metrics")
"""Commands that run for long, and whose output can be JSON."""


def main(
    arguments: Sequence[str] | None = None, parser: argparse.ArgumentParser | None = None
) -> int:
    """Run a command and return its exit code (see `crcolony.errors`); a CrcolonyError is printed in one line.

    `parser` is that of all commands, where it has been made already.
    """
    end_with_parent()
    words = sys.argv[1:] if arguments is None else list(arguments)
    with standard_streams() as streams, _output(words):
        code = _run(words, parser or make_parser())
        with contextlib.suppress(BrokenPipeError):
            sys.stdout.flush()
        if streams.error is None or code != EXIT_OK:
            return code
        if isinstance(streams.error, BrokenPipeError):
            return EXIT_UNREAD
        _print_error(f"standard output: {streams.error.strerror}")
        return EXIT_WRONG_INPUT


def _output(words: list[str]) -> contextlib.AbstractContextManager[None]:
    """Return the context in which a command prints: errors of its options must be JSON too, if that is asked for."""
    command = words[0] if words else ""
    if command in LOGGING and _log_format(words) == "json":
        return json_output(command)
    return contextlib.nullcontext()


def _log_format(words: list[str]) -> str | None:
    option = argparse.ArgumentParser(add_help=False, exit_on_error=False)
    option.add_argument("--log-format")
    try:
        found: str | None = option.parse_known_args(words)[0].log_format
    except argparse.ArgumentError:  # it has no value, which is reported later
        found = None
    return found or os.environ.get(LOG_FORMAT)


def _run(arguments: Sequence[str], parser: argparse.ArgumentParser) -> int:
    if "_ARGCOMPLETE" in os.environ:
        import argcomplete

        argcomplete.autocomplete(parser)
    try:
        options = parser.parse_args(arguments)
        _prepare_output(options)
        code: int = options.command(options)
    except SystemExit as ended:  # argparse's own way, after --help and for wrong options
        return int(ended.code or EXIT_OK)
    except (ImportError, CrcolonyError) as error:
        _print_error(str(error))
        return EXIT_WRONG_INPUT
    except FatalStorageError as error:
        _print_error(str(error))
        return EXIT_FATAL
    except KeyboardInterrupt:
        _print_error("interrupted")
        return EXIT_INTERRUPTED
    except BrokenPipeError:  # the reader of our output is gone, before there was anything to save
        return EXIT_UNREAD
    except (
        OSError
    ) as error:  # a file was refused where no one had thought of it; without a file it is a bug
        if error.errno in (errno.EMFILE, errno.ENFILE):
            _print_error("too many open files: raise the limit, as with ulimit -n 4096")
            return EXIT_WRONG_INPUT
        if error.filename is None:
            raise
        _print_error(f"{error.filename}: {error.strerror}")
        return EXIT_WRONG_INPUT
    return code


def _prepare_output(options: argparse.Namespace) -> None:
    """Check the format of the output where there is one, and add to JSON which process it is."""
    if not hasattr(options, "log_format"):
        return
    asked = os.environ.get(LOG_FORMAT) or FORMATS[0]
    if options.log_format is None and asked not in FORMATS:
        raise UsageError(f"{LOG_FORMAT}={asked}: must be {' or '.join(FORMATS)}")
    if isinstance(sys.stdout, JsonLines):
        names = {name: getattr(options, name) for name in options.log_names}
        sys.stdout.log.names.update({name: text for name, text in names.items() if text != "*"})


def _print_error(message: str) -> None:
    print(f"crcolony: {one_line(message)}", file=sys.stderr)


class _Parser(argparse.ArgumentParser):
    """Prints errors of the options in one line, with the word that was probably meant."""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Return the options; words that are none are an error of this command, not of `crcolony`."""
        options, unknown = super().parse_known_args(args, namespace)
        if unknown:
            option = unknown[0].partition("=")[0]
            hint = did_you_mean(option, self._option_string_actions)
            self.error(f"unrecognized arguments: {' '.join(unknown)}{hint}")
        return options, unknown

    def error(self, message: str) -> NoReturn:
        """End with one line."""
        if wrong := re.search(r"invalid choice: '(.*)' \(choose from (.*)\)", message):
            hint = did_you_mean(wrong[1], re.findall(r"[\w-]+", wrong[2]))
            message = f"there is no command {wrong[1]!r}" if "COMMAND" in message else message
            message += hint
        self.exit(EXIT_WRONG_INPUT, f"{self.prog}: {one_line(message)} (see {self.prog} --help)\n")


class _Version(argparse.Action):
    """Prints the version, which is looked up only then: that takes longer than `crcolony --help`."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> NoReturn:
        import crcolony

        print(f"{parser.prog} {crcolony.__version__}")
        parser.exit()


def make_parser() -> argparse.ArgumentParser:
    """Return the parser of all commands."""
    parser = _Parser(
        prog="crcolony",
        description="A colony of robots that evolves how to learn, with nobody in charge.",
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and exit")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for name, add_options, summary in COMMANDS:
        add_options(commands.add_parser(name, help=summary, description=summary))
    return parser
