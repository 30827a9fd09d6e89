"""How long a user waits from `crcolony launch` until all robots see each other, and until the first mating.

Run with `make bench`, or `python -m tests.benchmarks.bench_launch [4 64 128]`. Compiled code is cached. What is
measured is published by the robots: their states, which count the peers that they see, and their events. The baseline,
in the same run, is the same launch with a new interpreter for each process. Private memory is what a robot alone has
written to, and CPU is what it has used by the time that all see each other.
"""

import argparse
import contextlib
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import psutil

from crcolony.protocol.codec import WireError
from crcolony.protocol.key_expressions import ColonyKeys
from crcolony.protocol.signed_telemetry import open_telemetry
from crcolony.protocol.telemetry_messages import Exchanged, decode_event, decode_state
from crcolony.transport.network_settings import NetworkSettings
from tests.benchmarks.processes import COLONY, Wire, here, stop

TARGETS_S = {4: 1.5, 64: 5.0, 128: 15.0}
"""By number of robots, until all see each other"""
REPEATS = {4: 3}
HZ = {64: "5", 128: "2"}
"""Control rate by number of robots: all of them share two cores; four robots run in lockstep"""
HELD_S = 5.0
"""For how long all robots have to be seen afterwards"""
CROWDED = ("life.initial_energy=1.0", "arena.area_per_robot_m2=0.4")
FORKED = "from crcolony.cli import main; import sys; sys.exit(main(sys.argv[1:]))"
NEW_INTERPRETERS = f"""
import contextlib
from crcolony.runtime import forked_process
from crcolony.runtime.started_process import start_interpreter
class NoServer(contextlib.nullcontext):
    def __enter__(self): return self
    start = staticmethod(start_interpreter)
forked_process.ForkServer = NoServer
{FORKED}
"""
"""A launch as it was before there was a fork server."""
MIB = 2**20


@dataclass
class Started:
    """What was measured of one launch."""

    seen_s: float
    """Until all robots saw each other"""
    mated_s: float | None
    """Until the first mating, if there was one"""
    robot_cpu_s: float
    robot_private_mib: float
    """Of a robot, the median"""
    lost: int
    """Robots that did not see all others a while later"""
    output: list[bytes]
    """Lines on standard error"""


def measure(program: str, robots: int, folder: Path) -> Started:
    """Launch a colony, and measure it."""
    endpoint, keys = here(), ColonyKeys(COLONY)
    command = [
        sys.executable, "-c", program, "launch", "-n", str(robots), "--colony", COLONY, "--no-plots",
        "--out", str(folder), "--listen", endpoint,
    ]  # fmt: skip
    command += ["--hz", HZ[robots]] if robots in HZ else []
    for setting in CROWDED:
        command += ["--set", setting]
    start_s = time.perf_counter()
    with Wire(NetworkSettings(connect=(endpoint,)), keys.all_states, keys.all_events) as wire:
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        assert process.stderr is not None
        try:
            watch = Watch(wire, robots, start_s)
            watch.wait_until_seen()
            cpu_s, private_mib = _cost_of_a_robot(process.pid)
            if robots not in HZ:
                watch.wait_until_mated()
            lost = watch.lost_after(HELD_S) if robots in HZ else 0
        finally:
            stop([process])
        lines = process.stderr.read().splitlines()
    return Started(watch.seen_s, watch.mated_s, cpu_s, private_mib, lost, lines)


class Watch:
    """What robots publish."""

    def __init__(self, wire: Wire, robots: int, start_s: float) -> None:
        self.seen_s = 0.0
        self.mated_s: float | None = None
        self._wire, self._robots, self._start_s = wire, robots, start_s
        self._peers: dict[bytes, tuple[float, int]] = {}

    def wait_until_seen(self) -> None:
        """Wait until every robot sees all others."""
        while self._seeing(0.0) < self._robots:
            self._receive()
        self.seen_s = time.perf_counter() - self._start_s

    def wait_until_mated(self) -> None:
        """Wait until two robots have mated."""
        while self.mated_s is None:
            self._receive()

    def lost_after(self, held_s: float) -> int:
        """Return how many robots do not say, in the last two seconds of such a time, that they see all others."""
        end_s = time.perf_counter() + held_s
        while time.perf_counter() < end_s:
            self._receive()
        return self._robots - self._seeing(end_s - 2.0)

    def _seeing(self, since_s: float) -> int:
        return sum(
            at_s > since_s and peers == self._robots - 1 for at_s, peers in self._peers.values()
        )

    def _receive(self) -> None:
        data, now_s = self._wire.get(), time.perf_counter()
        content = open_telemetry(data).content
        with contextlib.suppress(WireError):
            state = decode_state(content)
            self._peers[state.robot] = now_s, state.peers
        with contextlib.suppress(WireError):
            if isinstance(decode_event(content).event, Exchanged):
                self.mated_s = self.mated_s or now_s - self._start_s


def _cost_of_a_robot(launch: int) -> tuple[float, float]:
    """Return CPU time (s) and private memory (MiB) of the robots of a launch, each the median."""
    robots = [one for one in psutil.Process(launch).children() if "robot" in one.cmdline()]
    cpu_s = [sum(one.cpu_times()[:2]) for one in robots]
    private = [one.memory_full_info().uss / MIB for one in robots]
    return statistics.median(cpu_s), statistics.median(private)


def report(robots: int, started: Sequence[Started], former: Sequence[Started]) -> None:
    """Print the figures of a colony, and of the same one with a new interpreter for each process."""

    def median(of: Sequence[Started], name: str) -> float:
        return statistics.median(float(getattr(one, name)) for one in of)

    def line(what: str, name: str, unit: str) -> str:
        now, before = median(started, name), median(former, name)
        return f"  {what}: {now:.2f} {unit}, {now / before:.2f} of new interpreters ({before:.2f})"

    print(f"launch of {robots} robots:")
    target = f" (target {TARGETS_S[robots]:g})" if robots in TARGETS_S else ""
    print(line("until all see each other", "seen_s", "s") + target)
    print(line("a robot's CPU by then", "robot_cpu_s", "s"))
    print(line("a robot's private memory", "robot_private_mib", "MiB"))
    if robots not in HZ:
        print(line("until the first mating, in a crowded arena", "mated_s", "s"))
    else:
        lost, lines = sum(one.lost for one in started), sum(len(one.output) for one in started)
        print(f"  lost {HELD_S:g} s later: {lost}; lines on standard error: {lines}", flush=True)


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser()
    parser.add_argument("robots", nargs="*", type=int, default=[4, 64])
    for robots in parser.parse_args().robots:
        measured: dict[str, list[Started]] = {FORKED: [], NEW_INTERPRETERS: []}
        with tempfile.TemporaryDirectory() as folder:
            for turn in range(REPEATS.get(robots, 1)):
                for number, (program, results) in enumerate(measured.items()):
                    results.append(measure(program, robots, Path(folder) / f"{turn}-{number}"))
        report(robots, *measured.values())


if __name__ == "__main__":
    main()
