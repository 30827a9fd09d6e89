"""Options of the commands that use the network: endpoints, names, the clock, and the config for many robots."""

import argparse
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from crcolony.commands.options import (
    UsageError,
    check_minutes,
    load_config,
    settings_of,
)

if TYPE_CHECKING:
    from crcolony.commands.earlier_run import Start
    from crcolony.config import Config
    from crcolony.transport.network_settings import NetworkSettings

NAME_RULE = "letters, digits, . _ and -, at most 64"
"""Of the names of colonies and arenas, which are parts of key expressions."""

_OPEN_NETWORK = "CRCOLONY_OPEN_NETWORK"
"""The environment variable that allows `--open-network`: one switch could be copied by accident."""


def add_network(parser: argparse.ArgumentParser) -> None:
    """Add the options for reaching other processes."""
    parser.add_argument(
        "--connect",
        action="append",
        default=[],
        metavar="ENDPOINT",
        help="endpoint of a peer or router to connect to, as in tcp/10.0.0.1:7447 or"
        " tcp/[fe80::1]:7447; may be repeated",
    )
    parser.add_argument(
        "--listen",
        action="append",
        default=[],
        metavar="ENDPOINT",
        help="endpoint to listen on; may be repeated; default: a free port",
    )
    parser.add_argument(
        "--interface",
        default="",
        metavar="NAME",
        help="discover peers by multicast on this network interface",
    )
    parser.add_argument(
        "--credentials",
        type=Path,
        metavar="DIR",
        help="this process's credentials in a deployment (crcolony enroll): only members can connect",
    )
    parser.add_argument(
        "--open-network",
        action="store_true",
        help="use a network beyond this machine without credentials: anybody on it may steer bodies;"
        f" {_OPEN_NETWORK}=yes must be set, too",
    )
    parser.add_argument(
        "--lease-ms",
        type=int,
        default=3000,
        metavar="MS",
        help="a silent peer is offline after this (default 3000); longer for a wireless network",
    )
    parser.add_argument(
        "--client",
        action="store_true",
        help="be a client of the routers given with --connect, not a peer",
    )


def add_no_shared_memory(parser: argparse.ArgumentParser) -> None:
    """Add the option that keeps robots and bodies on one machine on the network."""
    parser.add_argument(
        "--no-shared-memory",
        action="store_true",
        help="speak over the network with a body on this machine, too",
    )


def network_of(options: argparse.Namespace, listens_here: bool = False) -> "NetworkSettings":
    """Return the network settings of the options; without any, processes of one machine find each other.

    A process that `listens_here` listens on this machine's default endpoint, others connect to it. Raises UsageError,
    and NetworkError for a text that is no endpoint.
    """
    from crcolony.transport.network_settings import (
        HERE,
        HERE_ENCRYPTED,
        NetworkSettings,
        check_endpoints,
    )

    if not 500 <= options.lease_ms <= 600_000:
        raise UsageError(f"--lease-ms {options.lease_ms}: from 500 to 600000")
    if options.client and (options.listen or options.interface):
        raise UsageError("--client cannot be used with --listen or --interface")
    is_bare = not (options.connect or options.listen or options.interface)
    connect, listen = list(options.connect), list(options.listen)
    here = HERE if options.credentials is None else HERE_ENCRYPTED
    if listens_here and is_bare and not options.client:
        listen = [here]
    elif is_bare or (options.client and not connect):
        connect = [here]
    network = NetworkSettings(
        role="client" if options.client else "peer",
        connect=tuple(connect),
        listen=tuple(listen),
        interface=options.interface,
        lease_ms=options.lease_ms,
        credentials=options.credentials,
        is_open=options.open_network,
    )
    check_endpoints(network)
    _check_openness(network)
    return network


def _check_openness(network: "NetworkSettings") -> None:
    """Raise UsageError for a network beyond this machine without credentials, unless two switches allow it; say so."""
    from crcolony.transport.network_settings import exposed_endpoints

    if network.credentials is not None:
        return
    exposed = ", ".join(exposed_endpoints(network))
    is_allowed = os.environ.get(_OPEN_NETWORK) == "yes"
    if exposed and not (network.is_open and is_allowed):
        missing = f"{_OPEN_NETWORK}=yes" if network.is_open else "--open-network"
        raise UsageError(
            f"{exposed}: beyond this machine robots need --credentials (crcolony authority), or both"
            f" --open-network and {_OPEN_NETWORK}=yes, of which {missing} is missing"
        )
    if exposed:
        print(
            f"OPEN NETWORK: whoever reaches {exposed} may read everything and steer every body",
            file=sys.stderr,
            flush=True,
        )


def add_names(parser: argparse.ArgumentParser) -> None:
    """Add the options for the names of colony and arena."""
    parser.add_argument("--colony", default="colony", metavar="NAME", help=f"name: {NAME_RULE}")
    parser.add_argument("--arena", default="arena", metavar="NAME", help=f"name: {NAME_RULE}")


def add_clock(parser: argparse.ArgumentParser) -> None:
    """Add the options for the clock of an arena."""
    clock = parser.add_mutually_exclusive_group()
    clock.add_argument("--hz", type=float, metavar="H", help="control periods per second")
    clock.add_argument("--speed", type=float, metavar="X", help="speed as a multiple of real time")
    clock.add_argument(
        "--lockstep",
        action="store_true",
        help="as fast as possible: the arena waits for the action of every robot",
    )


def wall_period_s(options: argparse.Namespace, control_period_s: float) -> float | None:
    """Return the wall time of a control period, or None for lockstep; the default is real time.

    Raises UsageError.
    """
    for name, value in (("--hz", options.hz), ("--speed", options.speed)):
        if value is not None and not 0.001 <= value <= 10_000:
            raise UsageError(f"{name} {value:g}: must be from 0.001 to 10000")
    if options.lockstep:
        return None
    if options.hz is not None:
        return float(1.0 / options.hz)
    return float(control_period_s / (options.speed or 1.0))


def check_names(options: argparse.Namespace) -> None:
    """Raise UsageError for names that cannot be part of a key expression."""
    import re

    for option in ("colony", "arena"):
        name = getattr(options, option)
        if not re.fullmatch(r"[A-Za-z0-9_.-]{1,64}", name):
            raise UsageError(f"--{option} {name!r}: {NAME_RULE}")


def config_for_robots(
    options: argparse.Namespace, start: "Start", usual: int, spare_slots: int
) -> "Config":
    """Return the config for `-n` robots, for which an arena of this machine must have enough slots.

    Without -n there are as many robots as the command starts from, or the `usual` number; without --robots the arena
    has `spare_slots` more than robots, or what it had. Raises UsageError, ConfigError, or OpenFilesError for more
    robots than may open their files here.
    """
    from crcolony.config import check_distributed
    from crcolony.transport.open_files import allow_open_files

    check_names(options)
    check_minutes(options.minutes)
    if options.n is None:
        options.n = start.robots(usual)
    if options.n < 1:
        raise UsageError(f"-n {options.n}: must be at least 1")
    if options.robots is None and (start.folder is None or options.config is not None):
        options.robots = options.n + spare_slots
    config = load_config(start.config_file(options), settings_of(options))
    check_distributed(config)
    allow_open_files(options.n)
    has_own_arena = not getattr(options, "robots_only", False)
    if has_own_arena and config.robots < options.n:
        raise UsageError(f"-n {options.n}: the arena has {config.robots} slots (--robots)")
    return config
