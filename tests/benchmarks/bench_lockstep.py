"""Ticks a second of a lockstep colony of four robot processes, as `crcolony launch` starts it, on one machine.

Run with `make bench`, or `python -m tests.benchmarks.bench_lockstep`. Robots share memory with their bodies, or all
goes over the network, in the end with arena and robots on five hosts (network namespaces, where there can be any). The
baselines are bare fan-outs to four processes, with rows of the same sizes: through shared memory and eventfd, and over
Zenoh, a put to each and a put back, and a query to each and its reply; with Zenoh's threads as it comes, and with two
threads, as our processes have it.
"""

import contextlib
import mmap
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
import zenoh
from zenoh.handlers import Callback

from crcolony.body.contract import ACTION_WIDTH, OBSERVATION_WIDTH
from crcolony.compiled import FloatArray
from crcolony.protocol.body_messages import Action, Observation, pack_row
from crcolony.protocol.codec import encode
from crcolony.protocol.key_expressions import ArenaKeys
from crcolony.protocol.telemetry_messages import decode_scene
from crcolony.transport.network_settings import NetworkSettings
from tests.benchmarks.processes import ARENA, COLONY, Wire, child, commands, here
from tests.support.namespaces import enter, hosts, missing_requirement

ROBOTS = 4
TURNS, TICKS = 7, 500
WARM_TICKS, MEASURED_S = 200, 10.0
OF_MEMORY, OF_NETWORK, OF_ZENOH = 0.3, 8.0, 0.36
"""Targets: of bare shared memory, of our lockstep over the network, and of that over bare Zenoh"""

OBSERVATION = encode(Observation(2**61, 10**4, pack_row(np.ones(OBSERVATION_WIDTH)), None))
ACTION = encode(Action(10**4, pack_row(np.ones(ACTION_WIDTH))))


def answer(
    connection: Connection, network: NetworkSettings, number: int, namespace: str | None
) -> None:
    """Act on every observation, put or asked for, with nothing in between."""
    if namespace is not None:
        enter(namespace)
    with Wire(network, f"bench/observation/{number}") as wire:

        def reply(query: zenoh.Query) -> None:
            query.reply(query.key_expr, ACTION)

        key = f"bench/ask/{number}"
        with wire.session.declare_queryable(key, Callback(reply, indirect=False)):
            wire.wait_for_subscriber("bench/action")
            connection.send("ready")
            while True:
                if wire.get():
                    wire.put("bench/action", ACTION)


def bare(endpoint: str, namespaces: Sequence[str] = ()) -> tuple[float, float]:
    """Return fan-outs a second by puts, and by queries, to processes of this machine or in namespaces."""
    with contextlib.ExitStack() as opened:
        wire = opened.enter_context(Wire(NetworkSettings(listen=(endpoint,)), "bench/action"))
        network = NetworkSettings(connect=(endpoint,))
        where: Sequence[str | None] = namespaces or [None] * ROBOTS
        robots = [opened.enter_context(child(answer, network, k, where[k])) for k in range(ROBOTS)]
        assert [robot.recv() for robot in robots] == ["ready"] * ROBOTS
        for number in range(ROBOTS):
            wire.wait_for_subscriber(f"bench/observation/{number}")

        def by_puts() -> None:
            for number in range(ROBOTS):
                wire.put(f"bench/observation/{number}", OBSERVATION)
            for _ in range(ROBOTS):
                while not wire.get():
                    pass

        def take(reply: zenoh.Reply) -> None:
            assert reply.ok is not None
            wire.queue.put(reply.ok.payload.to_bytes())

        def by_queries() -> None:
            for number in range(ROBOTS):
                wire.session.get(
                    f"bench/ask/{number}",
                    sample,
                    payload=OBSERVATION,
                    consolidation=zenoh.ConsolidationMode.NONE,
                )
            for _ in range(ROBOTS):
                wire.get()

        sample: Any = Callback(take, indirect=False)
        turns = [(rate(by_puts), rate(by_queries)) for _ in range(TURNS)]
    puts, queries = map(statistics.median, zip(*turns, strict=True))
    return puts, queries


def rate(tick: Callable[[], None]) -> float:
    start = time.perf_counter()
    for _ in range(TICKS):
        tick()
    return TICKS / (time.perf_counter() - start)


def bare_memory() -> float:
    """Return fan-outs a second through shared memory, to processes that are forked."""
    rows = np.frombuffer(mmap.mmap(-1, 8 * ROBOTS * 64)).reshape(ROBOTS, 64)
    row, acted = np.ones(OBSERVATION_WIDTH), os.eventfd(0)
    bells = [os.eventfd(0) for _ in range(ROBOTS)]
    robots = [_fork_echo(own, bell, acted) for own, bell in zip(rows, bells, strict=True)]

    def tick() -> None:
        for own, bell in zip(rows, bells, strict=True):
            own[:OBSERVATION_WIDTH] = row
            os.eventfd_write(bell, 1)
        waiting = ROBOTS
        while waiting:
            waiting -= os.eventfd_read(acted)
        for own in rows:
            own[-ACTION_WIDTH:].copy()

    try:
        return statistics.median(rate(tick) for _ in range(TURNS))
    finally:
        for robot in robots:
            os.kill(robot, signal.SIGKILL)


def _fork_echo(rows: FloatArray, bell: int, acted: int) -> int:
    """Return a child that acts on every observation, with nothing in between."""
    robot = os.fork()
    if robot:
        return robot
    action = np.ones(ACTION_WIDTH)
    while True:
        os.eventfd_read(bell)
        rows[:OBSERVATION_WIDTH].copy()
        rows[-ACTION_WIDTH:] = action
        os.eventfd_write(acted, 1)


def lockstep(
    endpoint: str, folder: Path, *options: str, before: Sequence[Sequence[str]] = ()
) -> float:
    """Return ticks a second of an arena and four robots; `before` is put in front of each of the five commands."""
    arena = ["arena", "--lockstep", "--expect", str(ROBOTS), "--listen", endpoint]
    robots = [
        [
            "robot", "--colony", COLONY, "--number", str(number), "--repeatable",
            "--out", str(folder / str(number)), "--connect", endpoint, *options,
        ]
        for number in range(ROBOTS)
    ]  # fmt: skip
    folder.mkdir()
    if before:
        arena.append("--open-network")
        robots = [[*robot, "--open-network"] for robot in robots]
    lines = [[*line, "--arena", ARENA] for line in (arena, *robots)]
    scenes = Wire(NetworkSettings(connect=(endpoint,)), ArenaKeys(ARENA).scene)
    with commands(folder, *lines, before=before), scenes as wire:
        first = None
        while True:
            scene, now_s = decode_scene(wire.get_telemetry()), time.perf_counter()
            if first is None and scene.tick > WARM_TICKS:
                first = scene.tick, now_s
            elif first is not None and now_s >= first[1] + MEASURED_S:
                return (scene.tick - first[0]) / (now_s - first[1])


def apart(what: str, **environment: str) -> list[float]:
    """Return what another process of this file measures: the choice of Zenoh's threads is for a process's life."""
    words = [sys.executable, "-m", "tests.benchmarks.bench_lockstep", what]
    return list(map(float, subprocess.check_output(words, env=os.environ | environment).split()))


def on_hosts(endpoint: str, *namespaces: str) -> tuple[float, float, float]:
    """Return what an arena in this namespace and robots in others reach: ticks a second, and bare fan-outs."""
    prefixes = [(), *(("ip", "netns", "exec", name) for name in namespaces)]
    with tempfile.TemporaryDirectory() as folder:
        ticks = lockstep(endpoint, Path(folder, "hosts"), before=prefixes)
    return ticks, *bare(endpoint, namespaces)


def print_across_hosts() -> None:
    """Measure a colony of five hosts."""
    if reason := missing_requirement():
        print(f"lockstep across hosts: not measured; {reason}")
        return
    with hosts(ROBOTS + 1) as lan:
        names = [host.name for host in lan[1:]]
        words = [*lan[0].before, sys.executable, "-m", "tests.benchmarks.bench_lockstep"]
        words += ["--hosts", f"tcp/{lan[0].address}:7447", *names]
        environment = os.environ | {"CRCOLONY_OPEN_NETWORK": "yes"}
        measured = subprocess.check_output(words, env=environment, text=True).split()
    ticks, puts, queries = map(float, measured)
    print(f"lockstep across {ROBOTS + 1} network namespaces: {ticks:.0f} ticks a second")
    print(
        f"  bare fan-out of Zenoh there: by queries {queries:.0f} (ratio {ticks / queries:.2f},"
        f" target {OF_ZENOH}), by puts {puts:.0f} (ratio {ticks / puts:.2f})"
    )


def main() -> None:
    if sys.argv[1:2] == ["--hosts"]:
        print(*on_hosts(*sys.argv[2:]))
        return
    if sys.argv[1:] == ["--bare"]:
        print(*bare(here()))
        return
    if sys.argv[1:] == ["--memory"]:
        print(bare_memory())
        return
    with tempfile.TemporaryDirectory() as folder:
        memory = lockstep(here(), Path(folder, "memory"))
        network = lockstep(here(), Path(folder, "network"), "--no-shared-memory")
    (bare_rows,) = apart("--memory")
    print(f"lockstep, {ROBOTS} robot processes that share memory: {memory:.0f} ticks a second")
    print(
        f"  of bare shared memory {bare_rows:.0f}: {memory / bare_rows:.2f}  (target {OF_MEMORY})"
    )
    print(f"  of ours over the network: {memory / network:.1f}  (target {OF_NETWORK})")
    print(f"lockstep over the network: {network:.0f} ticks a second  (target {OF_ZENOH} of bare)")
    for name, (puts, queries) in (
        ("as it comes", apart("--bare", ZENOH_RUNTIME="()")),
        ("on two threads", bare(here())),
    ):
        print(
            f"  bare fan-out of Zenoh {name}: by queries {queries:.0f} (ratio {network / queries:.2f}),"
            f" by puts {puts:.0f} (ratio {network / puts:.2f})"
        )
    print_across_hosts()


if __name__ == "__main__":
    main()
