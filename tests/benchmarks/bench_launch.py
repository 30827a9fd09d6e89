"""How long a user waits from `crcolony launch -n 4` until all robots see each other, and until the first mating.

Run with `make bench`, or `python -m tests.benchmarks.bench_launch`. Compiled code is cached. What is measured is
published by the robots: their states, which count the peers that they see, twice a second, and their events.
"""

import contextlib
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from crcolony.protocol.codec import WireError
from crcolony.protocol.key_expressions import ColonyKeys
from crcolony.protocol.telemetry_messages import Exchanged, decode_event, decode_state
from crcolony.transport.network_settings import NetworkSettings
from tests.benchmarks.processes import COLONY, Wire, here, stop

ROBOTS, REPEATS = 4, 3
TARGET_S = 3.0
CROWDED = ("life.initial_energy=1.0", "arena.area_per_robot_m2=0.4")


def waits(folder: Path) -> tuple[float, float]:
    """Return the time until all robots see each other, and until the first mating."""
    endpoint, keys = here(), ColonyKeys(COLONY)
    command = [
        sys.executable, "-m", "crcolony", "launch", "-n", str(ROBOTS), "--colony", COLONY,
        "--out", str(folder), "--listen", endpoint,
    ]  # fmt: skip
    for setting in CROWDED:
        command += ["--set", setting]
    start_s = time.perf_counter()
    with Wire(NetworkSettings(connect=(endpoint,)), keys.all_states, keys.all_events) as wire:
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
        try:
            return _monitor(wire, start_s)
        finally:
            stop([process])


def _monitor(wire: Wire, start_s: float) -> tuple[float, float]:
    peers: dict[bytes, int] = {}
    seen_s = mated_s = 0.0
    while not (seen_s and mated_s):
        data, now_s = wire.get(), time.perf_counter()
        with contextlib.suppress(WireError):
            state = decode_state(data)
            peers[state.robot] = state.peers
            if list(peers.values()) == [ROBOTS - 1] * ROBOTS:
                seen_s = seen_s or now_s - start_s
        with contextlib.suppress(WireError):
            if isinstance(decode_event(data).event, Exchanged):
                mated_s = mated_s or now_s - start_s
    return seen_s, mated_s


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        times = [waits(Path(folder) / str(turn)) for turn in range(REPEATS)]
    seen_s, mated_s = map(statistics.median, zip(*times, strict=True))
    print(
        f"launch of {ROBOTS} robots, until all see each other: {seen_s:.1f} s (target {TARGET_S:g})"
    )
    print(f"until the first mating, in a crowded arena: {mated_s:.1f} s")


if __name__ == "__main__":
    main()
