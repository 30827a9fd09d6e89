"""`crcolony metrics`: the metrics of colonies, printed once or served until it is stopped."""

import sys
import threading
import time
from collections.abc import Iterable

from prometheus_client.openmetrics.exposition import generate_latest
from prometheus_client.process_collector import ProcessCollector
from prometheus_client.registry import CollectorRegistry

from crcolony.protocol.identity import RobotId
from crcolony.runtime.console import print_line
from crcolony.shutdown import ShutdownSignal
from crcolony.telemetry.subscriber import TelemetrySubscriber
from crcolony.telemetry.wait_for_states import wait_for_states
from crcolony.transport.brief_session import brief_session
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.wait_for_network import open_connection
from crcolony_deploy.metrics_exporter import MetricsExporter
from crcolony_deploy.metrics_server import serving

_POLL_S = 0.25
"""Between two polls of the telemetry."""


def serve_metrics(
    network: NetworkSettings, colony: str, robots: Iterable[RobotId] | None, address: str
) -> None:
    """Serve the metrics of a colony (`*`: of all) until stopped; raises CrcolonyError.

    Where the network is not there yet, only what this process uses is served.
    """
    woken = threading.Event()
    stop = ShutdownSignal(wake=woken.set)
    registry = CollectorRegistry()
    ProcessCollector(registry=registry)
    with (
        serving(registry, address) as url,
        open_connection(network, stop, print_line) as connection,
    ):
        if connection is None:
            return
        print_line(f"metrics at {url}")
        subscriber = TelemetrySubscriber(connection.session, colony, sends_requests=True)
        connection.add_user(subscriber)
        exporter = MetricsExporter(
            subscriber.monitor,
            robots,
            lambda: subscriber.dropped,
            lambda: connection.check.problems,
        )
        registry.register(exporter)
        while not stop():
            connection.handle_timers(time.monotonic())
            with exporter.lock:
                exporter.handle_changes(subscriber.poll())
            woken.wait(_POLL_S)


def print_metrics(
    network: NetworkSettings, colony: str, robots: Iterable[RobotId] | None, seconds: float
) -> None:
    """Print the metrics of a colony once, in OpenMetrics form; raises NetworkError where nobody answers."""
    with brief_session(network) as session:
        subscriber = TelemetrySubscriber(session, colony)
        exporter = MetricsExporter(subscriber.monitor, robots, lambda: subscriber.dropped)
        wait_for_states(session, subscriber, network, seconds, exporter.handle_changes)
        registry = CollectorRegistry()
        registry.register(exporter)
        text: bytes = generate_latest(registry)  # type: ignore[no-untyped-call]
        sys.stdout.write(text.decode())
