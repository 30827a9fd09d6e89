"""`crcolony deploy`: check what is to run on which host of a LAN, and collect what hosts without internet install."""

import argparse
from pathlib import Path

from crcolony.commands.options import UsageError, add_examples
from crcolony.errors import EXIT_OK

_ACTIONS = ("check", "wheelhouse")


def add_deploy(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony deploy`."""
    parser.add_argument(
        "action",
        choices=_ACTIONS,
        help="check an inventory; or collect the packages that its hosts install",
    )
    parser.add_argument(
        "path", type=Path, metavar="PATH", help="the inventory; or the folder for the packages"
    )
    parser.add_argument(
        "--json", action="store_true", help="check: print what runs where as JSON, for the playbook"
    )
    collected = parser.add_argument_group("wheelhouse")
    collected.add_argument(
        "--source",
        type=Path,
        default=Path(),
        metavar="DIR",
        help="checkout that is deployed (default: this folder)",
    )
    collected.add_argument(
        "--machine",
        action="append",
        default=[],
        metavar="NAME",
        help="processor of hosts, as uname -m has it; may be repeated (default: x86_64 and aarch64)",
    )
    collected.add_argument(
        "--python",
        action="append",
        default=[],
        metavar="X.Y",
        help="version of Python of hosts; may be repeated (default: that of this computer)",
    )
    collected.add_argument(
        "--extra",
        action="append",
        default=[],
        metavar="NAME",
        help="bridge, deploy or viz; may be repeated (default: bridge)",
    )
    parser.set_defaults(command=_deploy)
    add_examples(
        parser,
        ("crcolony deploy check inventory.yml", "what is wrong with it, or what runs where"),
        (
            "crcolony deploy wheelhouse wheelhouse --machine aarch64 --python 3.11",
            "for Raspberry Pis with Debian 12; in a checkout",
        ),
    )


def _deploy(options: argparse.Namespace) -> int:
    if options.action == "check":
        from crcolony_deploy.print_plan import check_inventory

        check_inventory(options.path, options.json)
    else:
        _collect(options)
    return EXIT_OK


def _collect(options: argparse.Namespace) -> None:
    import sys

    from crcolony_deploy.wheelhouse import (
        MACHINES,
        HostKind,
        WheelhouseOptions,
        collect,
        parse_python,
    )

    from crcolony.runtime.console import print_line

    for machine in options.machine:
        if machine not in MACHINES:
            raise UsageError(f"--machine {machine!r}: one of {', '.join(MACHINES)}")
    for extra in options.extra:
        if extra not in ("bridge", "deploy", "viz"):
            raise UsageError(f"--extra {extra!r}: one of bridge, deploy, viz")
    here = f"{sys.version_info.major}.{sys.version_info.minor}"
    pythons = [parse_python(text) for text in options.python] or [here]
    kinds = tuple(
        HostKind(machine, python) for machine in options.machine or MACHINES for python in pythons
    )
    extras = tuple(options.extra) or ("bridge",)
    identity = collect(WheelhouseOptions(options.path, options.source, kinds, extras), print_line)
    print_line(f"{options.path}: version {identity}")
