"""`crcolony bridge`: attach robots to this machine, so that robots of a colony can live in them."""

import argparse
from importlib.util import find_spec
from pathlib import Path

from crcolony.commands.network_options import NAME_RULE, add_network, check_names, network_of
from crcolony.commands.options import UsageError, add_examples, add_log_format
from crcolony.errors import EXIT_OK, CrcolonyError
from crcolony.shutdown import interrupted_once

_ACTIONS = ("serve", "list", "probe", "drive", "calibrate")


def add_bridge(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony bridge`."""
    parser.add_argument(
        "action",
        nargs="?",
        choices=_ACTIONS,
        default="serve",
        help="serve robots (default); list drivers and devices; probe, drive or calibrate one robot",
    )
    parser.add_argument(
        "--robot",
        action="append",
        default=[],
        metavar="DRIVER@ADDRESS",
        help="a robot, as in firmware@/dev/ttyACM0; may be repeated",
    )
    parser.add_argument("--arena", default="bridge", metavar="NAME", help=f"name: {NAME_RULE}")
    parser.add_argument(
        "--hz", type=float, default=10.0, help="control periods a second (default 10)"
    )
    parser.add_argument(
        "--energy-per-charge",
        type=float,
        default=1.0,
        metavar="E",
        help="energy that a battery gives when it is charged from empty to full (default 1)",
    )
    parser.add_argument(
        "--calibrations",
        type=Path,
        default=Path("calibrations"),
        metavar="DIR",
        help="folder with a file for each calibrated robot (default: calibrations)",
    )
    parser.add_argument(
        "--without-watchdog",
        action="store_true",
        help="also serve, drive and calibrate robots whose wheels turn on when this machine dies",
    )
    by_hand = parser.add_argument_group("drive and calibrate", "lift the robot, or give it space")
    by_hand.add_argument(
        "--speed", type=float, default=0.05, metavar="M_S", help="of the arrow keys (default 0.05)"
    )
    for wheel in ("left", "right"):
        by_hand.add_argument(
            f"--{wheel}", type=float, metavar="M_S", help="drive without keys, at this speed"
        )
    by_hand.add_argument("--seconds", type=float, default=2.0, metavar="S", help="default 2")
    add_network(parser)
    add_log_format(parser, "arena")
    parser.set_defaults(command=_bridge, colony="colony")
    add_examples(
        parser,
        ("crcolony bridge list", "which drivers and devices there are"),
        ("crcolony bridge probe --robot firmware@/dev/ttyACM0", "what it is, and what it measures"),
        (
            "crcolony bridge --robot firmware@/dev/ttyACM0 --robot firmware@/dev/ttyACM1",
            "two robots; then, for each: crcolony robot --arena bridge",
        ),
    )


def _bridge(options: argparse.Namespace) -> int:
    _check(options)
    _check_packages()
    if options.action == "list":
        from crcolony_bridge.driver_list import print_drivers

        print_drivers()
    elif options.action == "serve":
        from crcolony_bridge.start_bridge import BridgeOptions, run_bridge

        from crcolony.runtime.service_notify import service_notifier

        settings = BridgeOptions(
            tuple(options.robot),
            options.arena,
            1.0 / options.hz,
            options.energy_per_charge,
            options.calibrations,
            needs_watchdog=not options.without_watchdog,
        )
        run_bridge(settings, network_of(options, listens_here=True), service_notifier())
    else:
        with interrupted_once():  # a robot is left standing still, however this ends
            _use_on_bench(options)
    return EXIT_OK


def _check_packages() -> None:
    """Raise CrcolonyError if the packages of the extra `bridge` are missing."""
    missing = [name for name in ("serial", "cobs") if find_spec(name) is None]
    if missing:
        raise CrcolonyError(
            f"the bridge needs {' and '.join(missing)}, not installed here: pip install 'crcolony[bridge]'"
        )


def _use_on_bench(options: argparse.Namespace) -> None:
    from crcolony_bridge import bench
    from crcolony_bridge.calibrated_driver import CalibratedDriver
    from crcolony_bridge.driver_registry import make_driver

    from crcolony.runtime.console import print_line

    (robot,) = options.robot
    driver, needs_watchdog = make_driver(robot), not options.without_watchdog
    if options.action == "calibrate":
        path = bench.calibrate(
            driver, options.calibrations, options.speed, print_line, needs_watchdog=needs_watchdog
        )
        print_line(f"written to {path}")
        return
    calibrated = CalibratedDriver(driver, options.calibrations)
    if options.action == "probe":
        bench.probe(calibrated, print_line)
    elif options.left is None and options.right is None:
        from crcolony_bridge.arrow_keys import drive_with_keys

        drive_with_keys(calibrated, options.speed, print_line, needs_watchdog=needs_watchdog)
    else:
        left, right = options.left or 0.0, options.right or 0.0
        bench.drive(
            calibrated, left, right, options.seconds, print_line, needs_watchdog=needs_watchdog
        )


def _check(options: argparse.Namespace) -> None:
    """Raise UsageError for options that cannot be meant."""
    from crcolony.protocol.stop_messages import MAX_ATTACHED

    check_names(options)
    if not 1.0 <= options.hz <= 100.0:
        raise UsageError(f"--hz {options.hz:g}: must be from 1 to 100")
    if not 0.0 <= options.energy_per_charge <= 1e4:
        raise UsageError(f"--energy-per-charge {options.energy_per_charge:g}: from 0 to 10000")
    for name in ("left", "right", "speed"):
        value = getattr(options, name)
        if value is not None and not abs(value) <= 1.0:
            raise UsageError(f"--{name} {value:g}: must be from -1 to 1 m/s")
    if not 0.0 < options.seconds <= 60.0:
        raise UsageError(f"--seconds {options.seconds:g}: must be above 0 and at most 60")
    if options.action in ("calibrate", "drive") and options.speed < 0.02:
        raise UsageError(f"--speed {options.speed:g}: at least 0.02 m/s")
    if options.action != "list" and not options.robot:
        raise UsageError(
            "--robot is missing: which robot? crcolony bridge list shows what there is"
        )
    if len(options.robot) > MAX_ATTACHED:
        raise UsageError(f"{len(options.robot)} robots: a bridge has at most {MAX_ATTACHED}")
    if options.action not in ("list", "serve") and len(options.robot) > 1:
        raise UsageError(f"bridge {options.action}: one --robot at a time")
