"""The commands that put processes on the network: arena, robot, host, router, launch."""

import argparse
from typing import TYPE_CHECKING

from crcolony.commands.options import (
    UsageError,
    check_minutes,
    settings_of,
)

if TYPE_CHECKING:
    from crcolony.config import Config
    from crcolony.transport.zenoh_session import NetworkSettings

_NAME = "letters, digits, . _ and -, at most 64"


def add_network(parser: argparse.ArgumentParser) -> None:
    """Add the options that say how to reach the others."""
    parser.add_argument(
        "--connect",
        action="append",
        default=[],
        metavar="ENDPOINT",
        help="somebody to begin with, as in tcp/10.0.0.1:7447; may be repeated",
    )
    parser.add_argument(
        "--listen",
        action="append",
        default=[],
        metavar="ENDPOINT",
        help="where to be reached; default: a free port",
    )
    parser.add_argument(
        "--interface", default="", metavar="NAME", help="find each other by multicast there instead"
    )
    parser.add_argument(
        "--client", action="store_true", help="go through the routers given with --connect"
    )


def network_of(options: argparse.Namespace, listens_here: bool = False) -> "NetworkSettings":
    """Return how a process comes onto the network; without options, processes of one machine find each other."""
    from crcolony.transport.zenoh_session import HERE, NetworkSettings

    if options.client and (options.listen or options.interface):
        raise UsageError("--client goes with --connect alone")
    is_bare = not (options.connect or options.listen or options.interface)
    connect, listen = list(options.connect), list(options.listen)
    if listens_here and is_bare and not options.client:
        listen = [HERE]
    elif is_bare or (options.client and not connect):
        connect = [HERE]
    return NetworkSettings(
        role="client" if options.client else "peer",
        connect=tuple(connect),
        listen=tuple(listen),
        interface=options.interface,
    )


def _add_names(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--colony", default="colony", metavar="NAME", help=_NAME)
    parser.add_argument("--arena", default="arena", metavar="NAME", help=_NAME)


def _add_clock(parser: argparse.ArgumentParser) -> None:
    clock = parser.add_mutually_exclusive_group()
    clock.add_argument("--hz", type=float, metavar="H", help="control periods a second")
    clock.add_argument("--speed", type=float, metavar="X", help="times as fast as real time")
    clock.add_argument(
        "--lockstep", action="store_true", help="as fast as possible, waiting for every robot"
    )


def wall_period_s(options: argparse.Namespace, control_period_s: float) -> float | None:
    """Return the wall time of a tick, or None for lockstep; real time is the default."""
    for name, value in (("--hz", options.hz), ("--speed", options.speed)):
        if value is not None and not 0.001 <= value <= 10_000:
            raise UsageError(f"{name} {value:g}: must be from 0.001 to 10000")
    if options.lockstep:
        return None
    if options.hz is not None:
        return float(1.0 / options.hz)
    return float(control_period_s / (options.speed or 1.0))


def check_names(options: argparse.Namespace) -> None:
    """Raise UsageError for names that cannot be part of a key."""
    import re

    for option in ("colony", "arena"):
        name = getattr(options, option)
        if not re.fullmatch(r"[A-Za-z0-9_.-]{1,64}", name):
            raise UsageError(f"--{option} {name!r}: {_NAME}")


def _config_of_many(options: argparse.Namespace, spare_places: int) -> "Config":
    """Return the config for `-n` robots, whose arena has places for all of them unless it is somebody else's."""
    from crcolony.config import load

    check_names(options)
    check_minutes(options.minutes)
    if options.n < 1:
        raise UsageError(f"-n {options.n}: at least one robot")
    if options.robots is None:
        options.robots = options.n + spare_places
    config = load(options.config, settings_of(options))
    has_own_arena = not getattr(options, "robots_only", False)
    if has_own_arena and config.robots < options.n:
        raise UsageError(f"-n {options.n}: the arena has {config.robots} places")
    return config
