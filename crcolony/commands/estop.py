"""`crcolony estop`: stop all bodies at once, attached and simulated, and release them again."""

import argparse
import re
import sys
from typing import TYPE_CHECKING

from crcolony.commands.audit_options import add_audit_log, audit_log_of
from crcolony.commands.network_options import NAME_RULE, add_network, network_of
from crcolony.commands.options import UsageError, add_examples
from crcolony.errors import EXIT_NOT_CONFIRMED, EXIT_OK, CrcolonyError

if TYPE_CHECKING:
    from crcolony.runtime.emergency_stop import StopResult


def add_estop(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony estop`."""
    parser.add_argument(
        "--arena",
        default="*",
        metavar="NAME",
        help=f"of one arena or bridge; default: all ({NAME_RULE})",
    )
    parser.add_argument(
        "--clear", type=int, metavar="LATCH", help="release the bodies of the stop with this number"
    )
    add_network(parser)
    add_audit_log(parser)
    parser.set_defaults(command=_estop)
    add_examples(
        parser,
        ("crcolony estop", "every body of the network stands still, and stays so"),
        ("crcolony estop --clear 81723", "release them; the number is what estop has printed"),
    )


def _estop(options: argparse.Namespace) -> int:
    from crcolony.runtime.emergency_stop import stop_robots

    if options.arena != "*" and not re.fullmatch(r"[A-Za-z0-9_.-]{1,64}", options.arena):
        raise UsageError(f"--arena {options.arena!r}: {NAME_RULE}")
    if options.clear is not None and not 0 < options.clear < 2**62:
        raise UsageError(f"--clear {options.clear}: expected the number that estop has printed")
    result = stop_robots(network_of(options), options.arena, options.clear)
    for line in _lines(result, "stopped" if options.clear is None else "released"):
        print(line)
    _record(options, result)
    robots = [robot for reply in result.replies for robot in reply.robots]
    is_complete = robots and all(robot.confirmed for robot in robots) and not result.silent
    return EXIT_OK if is_complete else EXIT_NOT_CONFIRMED


def _record(options: argparse.Namespace, result: "StopResult") -> None:
    """Record a stop or a release that has been carried out; trouble with the log is said, and changes nothing else."""
    from crcolony_deploy.audit_log import record_action

    robots = [robot for reply in result.replies for robot in reply.robots]
    latches = sorted({reply.latch for reply in result.replies if reply.latch})
    try:
        record_action(
            audit_log_of(options),
            "stop" if options.clear is None else "release",
            arena=options.arena,
            latch=" ".join(map(str, latches)) if options.clear is None else options.clear,
            confirmed=sum(robot.count for robot in robots if robot.confirmed),
            bodies=sum(robot.count for robot in robots),
            silent=len(result.silent),
        )
    except CrcolonyError as error:  # what counts is that the robots stand still
        print(f"crcolony: {error}", file=sys.stderr)


def _lines(result: "StopResult", done: str) -> list[str]:
    robots = [robot for reply in result.replies for robot in reply.robots]
    if not result.is_connected:
        return ["nobody can be reached: what moves, moves on; is --connect right?"]
    if not result.replies and not result.silent:
        return ["no arena and no bridge is there: nothing to stop"]
    confirmed = sum(robot.count for robot in robots if robot.confirmed)
    total = sum(robot.count for robot in robots)
    lines = [f"{confirmed} of {total} bodies {done}, confirmed within {result.took_s:.2f} s"]
    lines += [
        f"NOT {done}: {robot.name} of {reply.address.arena}: {robot.trouble}"
        for reply in result.replies
        for robot in reply.robots
        if not robot.confirmed
    ]
    lines += [
        f"NO ANSWER from {address.arena} (session {address.session[:8]}): its bodies may move"
        for address in sorted(result.silent)
    ]
    latches = sorted({reply.latch for reply in result.replies if reply.latch})
    return lines + [f"to release: crcolony estop --clear {latch}" for latch in latches]
