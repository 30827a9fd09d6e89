"""`crcolony dashboard`: show colonies live in Rerun."""

import argparse
from pathlib import Path

from crcolony.commands.network_options import add_network, network_of
from crcolony.commands.options import UsageError, add_examples, add_log_format, check_minutes
from crcolony.errors import EXIT_OK

LIVE_PORT = 9876
"""The default port of Rerun's data, to which viewers connect."""
WEB_PORT = 9090
"""The default port of Rerun's web viewer."""


def add_dashboard(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony dashboard`."""
    parser.add_argument("--colony", default="*", metavar="NAME", help="name; default: all colonies")
    parser.add_argument(
        "--agent",
        default="",
        metavar="NAME",
        help="agent whose potentials are drawn; default: the best one",
    )
    show = parser.add_argument_group(
        "viewers", "without --web or --native, open the printed address in a viewer"
    )
    show.add_argument(
        "--web", action="store_true", help="serve a viewer for browsers on this machine"
    )
    show.add_argument("--native", action="store_true", help="open the native viewer of Rerun")
    show.add_argument(
        "--port",
        type=int,
        metavar="P",
        help=f"port for viewers (default {LIVE_PORT}, or a free one if that is in use)",
    )
    show.add_argument(
        "--web-port",
        type=int,
        metavar="P",
        help=f"port of --web (default {WEB_PORT}, or a free one if that is in use)",
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="folder of the recording; default: that of the colony if it is in runs, else the next free runs/N",
    )
    parser.add_argument("--no-recording", action="store_true", help="do not record")
    parser.add_argument(
        "--keep-hours",
        type=float,
        metavar="H",
        help="for weeks: keep poses and states for so many hours, events for good, and no .rrd",
    )
    parser.add_argument("--minutes", type=float, metavar="M", help="stop after so many minutes")
    add_network(parser)
    add_log_format(parser, "colony")
    parser.set_defaults(command=_dashboard)
    add_examples(
        parser,
        ("crcolony dashboard --web", "all colonies of this machine, in a browser"),
        (
            "crcolony dashboard --native --connect tls/10.0.0.1:7447 --credentials wall",
            "those of another machine, in Rerun's window",
        ),
    )


def _dashboard(options: argparse.Namespace) -> int:
    for name, port in (("--port", options.port), ("--web-port", options.web_port)):
        if port is not None and not 0 < port < 65536:
            raise UsageError(f"{name} {port}: must be from 1 to 65535")
    check_minutes(options.minutes)
    if options.no_recording and options.out is not None:
        raise UsageError("--no-recording cannot be used with --out")
    if options.keep_hours is not None and not 0.0 < options.keep_hours <= 87_600.0:
        raise UsageError(
            f"--keep-hours {options.keep_hours:g}: must be above 0 and at most 10 years"
        )
    from crcolony_dashboards.live import DashboardOptions, run_dashboard

    from crcolony.runtime.service_notify import service_notifier
    from crcolony.storage.claimed_folder import check_folder, make_numbered_folder

    if options.out is not None:
        check_folder(options.out, "dashboard")
    run_dashboard(
        DashboardOptions(
            network=network_of(options),
            colony=options.colony,
            port=options.port or _usual_or_free(LIVE_PORT),
            folder=options.out,
            new_folder=make_numbered_folder,
            records=not options.no_recording,
            web_port=options.web_port or _usual_or_free(WEB_PORT) if options.web else None,
            native=options.native,
            agent=options.agent,
            minutes=options.minutes,
            keep_s=3600.0 * options.keep_hours if options.keep_hours is not None else None,
        ),
        service_notifier(),
    )
    return EXIT_OK


def _usual_or_free(port: int) -> int:
    from crcolony.transport.zenoh_session import free_port, is_taken

    return free_port() if is_taken(f"tcp/127.0.0.1:{port}") else port
