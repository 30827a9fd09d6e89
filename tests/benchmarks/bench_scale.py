"""Large colonies on one machine: `crcolony host` processes as clients of one router, and of two.

Run with `python -m tests.benchmarks.bench_scale [100 300 1000]`. Every host has an arena of its own, so that what is
measured is the network: discovery (every robot counts all others as peers), idle cost, telemetry, the time until all
robots are seen again after a router was killed, and the mating latency of four robots in processes of their own among
all that traffic (from the meeting to the mating, by the robot's own clock). Compiled code is cached.
"""

import argparse
import contextlib
import statistics
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import psutil

from crcolony.protocol.codec import WireError
from crcolony.protocol.key_expressions import ColonyKeys
from crcolony.protocol.signed_telemetry import open_telemetry
from crcolony.protocol.telemetry_messages import Exchanged, Met, decode_event, decode_state
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_samples import callback
from crcolony.transport.zenoh_session import Session, free_port, open_session
from tests.support.process import Process, wait_until
from tests.support.process_colony import Colony, colony

A_HOST = 50
MEASURED = 4
IDLE_S = 15.0
MATING_S = 15.0
HZ = {100: 10.0, 300: 5.0, 1000: 2.0}
"""Control rate by number of robots: all of them share two cores."""


@dataclass
class Watched:
    """What an observer receives."""

    peers: dict[bytes, int] = field(default_factory=dict)
    seen_s: dict[bytes, float] = field(default_factory=dict)
    met_ms: dict[bytes, int] = field(default_factory=dict)
    latencies_ms: list[float] = field(default_factory=list)
    received_bytes: int = 0
    measured: set[bytes] = field(default_factory=set)
    """Robots whose matings are timed"""

    def subscribe(self, session: Session) -> list[object]:
        """Subscribe to states and events of the colony."""
        keys = ColonyKeys("colony")
        return [
            session.declare_subscriber(keys.all_states, callback(lambda s: self._on_state(s))),
            session.declare_subscriber(keys.all_events, callback(lambda s: self._on_event(s))),
        ]

    def _on_state(self, sample: object) -> None:
        data = sample.payload.to_bytes()  # type: ignore[attr-defined]
        self.received_bytes += len(data)
        with contextlib.suppress(WireError):
            state = decode_state(open_telemetry(data).content)
            self.peers[state.robot] = state.peers
            self.seen_s[state.robot] = time.monotonic()

    def _on_event(self, sample: object) -> None:
        data = sample.payload.to_bytes()  # type: ignore[attr-defined]
        self.received_bytes += len(data)
        with contextlib.suppress(WireError):
            message = decode_event(open_telemetry(data).content)
            if message.robot not in self.measured:
                return
            if isinstance(message.event, Met):
                self.met_ms[message.robot] = message.unix_ms
            elif isinstance(message.event, Exchanged) and message.robot in self.met_ms:
                self.latencies_ms.append(message.unix_ms - self.met_ms[message.robot])


@contextlib.contextmanager
def routers(made: Colony, count: int) -> Iterator[tuple[list[Process], tuple[str, ...]]]:
    """Start routers that are connected to each other; yields them, and the options of their clients."""
    endpoints = [f"tcp/127.0.0.1:{free_port()}" for _ in range(count)]
    started = []
    for number, endpoint in enumerate(endpoints):
        others = [word for other in endpoints[:number] for word in ("--connect", other)]
        started.append(made.start(f"router{number}", "router", "--listen", endpoint, *others))
    for router in started:
        router.wait_for("router at")
    connect = [word for endpoint in endpoints for word in ("--connect", endpoint)]
    yield started, ("--client", *connect)


def start_hosts(made: Colony, robots: int, client: tuple[str, ...]) -> list[Process]:
    """Start hosts with so many robots in all, and four robots in an arena of their own."""
    hz = ("--hz", f"{HZ.get(robots, 5.0):g}")
    hosts = [
        made.start(
            f"host{number}", "host", "--no-plots", "-n", str(A_HOST), "--robots", str(A_HOST),
            "--arena", f"arena{number}", *hz, *client, "--out", str(made.folder / f"host{number}"),
        )
        for number in range(robots // A_HOST)
    ]  # fmt: skip
    made.arena(MEASURED, "--hz", "10", *client, name="measured")
    for _ in range(MEASURED):
        made.robot("--arena", "measured", *client)
    return hosts


def measure(robots: int, router_count: int) -> None:
    """Print the figures of one colony."""
    total = robots + MEASURED
    with (
        tempfile.TemporaryDirectory() as folder,
        colony(Path(folder)) as made,
        routers(made, router_count) as (started, client),
    ):
        endpoints = client[2::2]
        network = NetworkSettings(role="client", connect=(endpoints[-1],))
        with open_session(network) as session:
            watched = Watched()
            held = watched.subscribe(session)
            hosts = start_hosts(made, robots, client)
            for host in hosts:
                host.wait_for("robots of colony", within_s=300.0)
            begun_s = time.monotonic()
            wait_until(
                lambda: len(watched.peers) == total and min(watched.peers.values()) >= total - 1,
                f"{total} robots see each other",
                300.0,
            )
            took_s = time.monotonic() - begun_s
            print(f"{robots} robots, {router_count} routers:", flush=True)
            print(f"  discovered {took_s:.1f} s after the last start", flush=True)
            watched.measured = set(made.ids)
            _report_idle(watched, hosts, started, robots)
            time.sleep(MATING_S)
            _report_latency(watched)
            if router_count > 1:
                _report_failover(watched, started[0], total)
            assert held


def _report_idle(
    watched: Watched, hosts: list[Process], routers_: list[Process], robots: int
) -> None:
    processes = {
        kind: [psutil.Process(one.pid) for one in group]
        for kind, group in (("hosts", hosts), ("routers", routers_))
    }
    before = {kind: _cpu_s(group) for kind, group in processes.items()}
    bytes_before, begun_s = watched.received_bytes, time.monotonic()
    time.sleep(IDLE_S)
    elapsed_s = time.monotonic() - begun_s
    for kind, group in processes.items():
        share = 100.0 * (_cpu_s(group) - before[kind]) / elapsed_s
        rss_mib = sum(one.memory_info().rss for one in group) / 2**20
        print(f"  {kind}: {share:.0f} % of a core, {rss_mib:.0f} MiB, in all", flush=True)
    rate = (watched.received_bytes - bytes_before) / elapsed_s
    each = rate / robots
    print(f"  telemetry to one observer: {rate / 1e3:.0f} kB/s, {each:.0f} B/s a robot", flush=True)


def _cpu_s(processes: list[psutil.Process]) -> float:
    return sum(sum(one.cpu_times()[:2]) for one in processes)


def _report_latency(watched: Watched) -> None:
    latencies = sorted(watched.latencies_ms)
    if latencies:
        p99_ms = latencies[min(int(0.99 * len(latencies)), len(latencies) - 1)]
        median_ms = statistics.median(latencies)
        line = f"from meeting to mating: median {median_ms:.0f} ms, p99 {p99_ms:.0f} ms"
        print(f"  {line} ({len(latencies)} matings)", flush=True)


def _report_failover(watched: Watched, router: Process, total: int) -> None:
    router.kill()
    killed_s = time.monotonic()
    wait_until(
        lambda: sum(at_s > killed_s + 0.2 for at_s in watched.seen_s.values()) >= total,
        "all robots are seen through the other router",
        60.0,
    )
    took_s = time.monotonic() - killed_s
    print(f"  a router killed: all robots seen through the other after {took_s:.1f} s", flush=True)


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser()
    parser.add_argument("robots", nargs="*", type=int, default=[100])
    for robots in parser.parse_args().robots:
        for router_count in (1, 2):
            measure(robots, router_count)


if __name__ == "__main__":
    main()
