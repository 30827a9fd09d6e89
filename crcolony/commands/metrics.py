"""`crcolony metrics`: the state of colonies as metrics for Prometheus, printed once or served."""

import argparse
from pathlib import Path

from crcolony.commands.network_options import add_network, network_of
from crcolony.commands.options import UsageError, add_examples, add_log_format
from crcolony.errors import EXIT_OK


def add_metrics(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony metrics`."""
    parser.add_argument("--colony", default="*", metavar="NAME", help="name; default: all colonies")
    parser.add_argument(
        "--serve",
        metavar="ADDRESS:PORT",
        help="serve them over HTTP, as at 127.0.0.1:9464, until stopped; default: print them once",
    )
    parser.add_argument(
        "--robots",
        type=Path,
        metavar="FILE",
        help="file with the ids of the robots that are exported, online or not; default: the first"
        " 1000 that come online",
    )
    parser.add_argument(
        "--seconds",
        type=float,
        default=1.5,
        metavar="S",
        help="time to listen before printing (default 1.5)",
    )
    add_network(parser)
    add_log_format(parser, "colony")
    parser.set_defaults(command=_metrics)
    add_examples(
        parser,
        ("crcolony metrics", "print them once, in OpenMetrics form"),
        (
            "crcolony metrics --serve 127.0.0.1:9464",
            "for Prometheus: deploy/monitoring/prometheus.yml",
        ),
        (
            "crcolony metrics --serve 127.0.0.1:9464 --robots robots.txt",
            "of these robots alone: one that is absent is offline, and no other makes series",
        ),
    )


def _metrics(options: argparse.Namespace) -> int:
    if not 0.0 < options.seconds <= 600.0:
        raise UsageError(f"--seconds {options.seconds:g}: must be above 0 and at most 600")
    try:
        from crcolony_deploy.metrics import print_metrics, serve_metrics
    except ModuleNotFoundError as error:
        if error.name is None or not error.name.startswith("prometheus_client"):
            raise
        raise UsageError(
            "metrics need prometheus-client, not installed here: pip install 'crcolony[deploy]'"
        ) from None
    from crcolony.protocol.identity import AllowList

    robots = AllowList.load(options.robots).listed if options.robots is not None else None
    if robots is not None and not robots:
        raise UsageError(f"{options.robots}: lists no robot")
    if options.serve is None:
        print_metrics(network_of(options), options.colony, robots, options.seconds)
    else:
        serve_metrics(network_of(options), options.colony, robots, options.serve)
    return EXIT_OK
