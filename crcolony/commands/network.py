"""The commands that put processes on the network: arena, robot, host, router, launch."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from crcolony.commands import (
    UsageError,
    add_config,
    check_minutes,
    new_folder,
    say_if_compiling,
    settings_of,
)
from crcolony.errors import EXIT_OK

if TYPE_CHECKING:
    from crcolony.colony.network import Network
    from crcolony.config import Config

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


def network_of(options: argparse.Namespace, listens_here: bool = False) -> "Network":
    """Return how a process comes onto the network; without options, processes of one machine find each other."""
    from crcolony.colony.network import HERE, Network

    if options.client and (options.listen or options.interface):
        raise UsageError("--client goes with --connect alone")
    is_bare = not (options.connect or options.listen or options.interface)
    connect, listen = list(options.connect), list(options.listen)
    if listens_here and is_bare and not options.client:
        listen = [HERE]
    elif is_bare or (options.client and not connect):
        connect = [HERE]
    return Network(
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


def add_arena(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony arena`."""
    add_config(parser)
    parser.add_argument(
        "--robots", type=int, metavar="N", help="places for so many bodies (default 4)"
    )
    parser.add_argument("--arena", default="arena", metavar="NAME", help=_NAME)
    parser.add_argument("--out", type=Path, metavar="DIR", help="keep the world there")
    parser.add_argument(
        "--expect", type=int, default=1, metavar="N", help="robots that lockstep begins with"
    )
    _add_clock(parser)
    add_network(parser)
    parser.set_defaults(command=_arena, colony="colony")


def _arena(options: argparse.Namespace) -> int:
    from crcolony.colony.processes.start_arena import run_arena
    from crcolony.config import load

    check_names(options)
    config = load(options.config, settings_of(options))
    if not 1 <= options.expect <= config.robots:
        raise UsageError(f"--expect {options.expect}: the arena has {config.robots} places")
    period_s = wall_period_s(options, config.arena.control_period_s)
    network = network_of(options, listens_here=True)
    say_if_compiling()
    run_arena(config, options.arena, network, period_s, options.expect, options.out)
    return EXIT_OK


def add_robot(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony robot`."""
    add_config(parser)
    _add_names(parser)
    parser.add_argument(
        "--key", type=Path, metavar="FILE", help="default: DIR/key, made if missing"
    )
    parser.add_argument("--number", type=int, default=-1, metavar="N", help="place it would like")
    parser.add_argument(
        "--repeatable",
        action="store_true",
        help="randomness from the config's seed and --number, not its own",
    )
    parser.add_argument(
        "--allow", type=Path, metavar="FILE", help="mate only with the robots listed there"
    )
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="its memory")
    parser.add_argument("--snapshot", type=float, default=10.0, metavar="SECONDS")
    add_network(parser)
    parser.set_defaults(command=_robot)


def _robot(options: argparse.Namespace) -> int:
    from crcolony.colony.processes.start import RobotOptions, run_robot
    from crcolony.config import load

    check_names(options)
    if options.repeatable and options.number < 0:
        raise UsageError("--repeatable needs --number")
    if not 0.1 <= options.snapshot <= 86_400:
        raise UsageError(f"--snapshot {options.snapshot:g}: from 0.1 to 86400 seconds")
    config = load(options.config, settings_of(options))
    network = network_of(options)
    say_if_compiling()
    run_robot(
        RobotOptions(
            config=config,
            folder=options.out,
            colony=options.colony,
            arena=options.arena,
            network=network,
            key=options.key,
            number=options.number,
            is_repeatable=options.repeatable,
            allow=options.allow,
            snapshot_s=options.snapshot,
        )
    )
    return EXIT_OK


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


def add_host(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony host`."""
    add_config(parser)
    _add_names(parser)
    parser.add_argument("-n", type=int, default=20, metavar="N", help="robots in this process")
    parser.add_argument("--robots", type=int, metavar="N", help="places for bodies; default: N + 8")
    parser.add_argument("--out", type=Path, metavar="DIR", help="their memories")
    parser.add_argument("--minutes", type=float, metavar="M", help="stop after so long")
    _add_clock(parser)
    add_network(parser)
    parser.set_defaults(command=_host)


def _host(options: argparse.Namespace) -> int:
    from crcolony.colony.processes.host import run_host

    config = _config_of_many(options, spare_places=8)
    period_s = wall_period_s(options, config.arena.control_period_s)
    network = network_of(options, listens_here=True)
    say_if_compiling()
    run_host(
        config,
        options.n,
        options.out or new_folder(),
        options.colony,
        options.arena,
        network,
        period_s,
        options.minutes,
    )
    return EXIT_OK


def add_router(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony router`."""
    add_network(parser)
    parser.set_defaults(command=_router)


def _router(options: argparse.Namespace) -> int:
    import msgspec

    from crcolony.colony.processes.start_arena import run_router

    if options.client:
        raise UsageError("a router is no client")
    network = msgspec.structs.replace(network_of(options, listens_here=True), role="router")
    run_router(network)
    return EXIT_OK


def add_launch(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony launch`."""
    add_config(parser)
    _add_names(parser)
    parser.add_argument("-n", type=int, default=4, metavar="N", help="robots to start here")
    parser.add_argument("--robots", type=int, metavar="N", help="places in the arena; default: -n")
    parser.add_argument(
        "--robots-only", action="store_true", help="join the arena of another machine"
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="results folder")
    parser.add_argument("--minutes", type=float, metavar="M", help="stop after so long")
    parser.add_argument(
        "--dashboard", action="store_true", help="show it in a browser, and record it into DIR"
    )
    _add_clock(parser)
    add_network(parser)
    parser.set_defaults(command=_launch)


def _launch(options: argparse.Namespace) -> int:
    from crcolony.colony.processes.children import Launch
    from crcolony.colony.processes.launch import run_launch

    config = _config_of_many(options, spare_places=0)
    if options.robots_only and (options.lockstep or options.hz or options.speed):
        raise UsageError("--robots-only: the clock is the arena's")
    is_lockstep = options.lockstep or not (options.hz or options.speed or options.robots_only)
    if options.robots > options.n and is_lockstep and not options.lockstep:
        is_lockstep = False  # others are to join: nobody waits for them
    options.lockstep = is_lockstep
    say_if_compiling()
    return run_launch(
        Launch(
            config=config,
            count=options.n,
            folder=options.out or new_folder(),
            colony=options.colony,
            arena=options.arena,
            network=None if _is_bare(options) else network_of(options),
            wall_period_s=wall_period_s(options, config.arena.control_period_s),
            robots_only=options.robots_only,
            minutes=options.minutes,
            has_dashboard=options.dashboard,
        )
    )


def _is_bare(options: argparse.Namespace) -> bool:
    return not (options.connect or options.listen or options.interface or options.client)
