"""Whether Zenoh's advanced publishers could replace our event buffer, sequence gaps, back-fill and history queries.

Run with `python -m tests.benchmarks.bench_advanced_pubsub [trial ...]`; it takes under three minutes.
Every trial runs twice, with ours and with `zenoh.ext`, between processes of this machine; docs/advanced_pubsub.md says
what follows from the figures.
"""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack

from crcolony.transport.network_settings import NetworkSettings
from tests.benchmarks.advanced_pubsub_hostile import deaf, flood, impersonate, memory, silence
from tests.benchmarks.advanced_pubsub_robots import CACHE, Kind, run_robots
from tests.benchmarks.advanced_pubsub_trial import (
    HISTORY,
    Row,
    Trial,
    format_arrival,
    format_load,
    peer,
    stopped,
    total,
    wait,
)

MAX_S = 155.0
"""Trials that have not begun by then are skipped: the machine is too busy."""
KINDS: tuple[Kind, Kind] = ("ours", "zenoh")


def late_observer(trial: Trial, count: int) -> Iterator[Row]:
    robots = trial.robots(count)
    robots.request("burst", 2 * HISTORY)
    observer = trial.observer()
    report = wait(observer, lambda now: total(now) >= HISTORY * count, 8.0)
    yield f"late: last {HISTORY} of {count} robots", format_arrival(report, HISTORY * count)


def late_link(trial: Trial) -> Iterator[Row]:
    robots = [trial.robots(1, first=number) for number in (1, 2, 3, 4)]
    for robot in robots:
        robot.request("burst", HISTORY)
        robot.request("rate", 200.0)
    observer = trial.listening_observer()
    observer.request("report")
    time.sleep(2.5)
    for robot in robots:
        robot.request("rate", 0.0)
    wanted = sum(robot.request("report").published for robot in robots)
    report = wait(observer, lambda now: total(now) >= wanted, 2.0)
    yield "links that form late, 4 robots at 200/s", format_arrival(report, wanted)


def watched(trial: Trial) -> Iterator[Row]:
    robots = trial.robots(1)
    robots.request("burst", CACHE)
    robots.request("rate", 30.0)
    time.sleep(0.5)
    before = robots.request("report")
    observer = trial.observer(CACHE)
    wait(observer, lambda now: total(now) >= CACHE, 6.0)
    load = format_load(before, robots.request("report"))
    yield f"one honest late observer wants all {CACHE}", load


def restart(trial: Trial) -> Iterator[Row]:
    with ExitStack() as life:
        network = NetworkSettings(listen=(trial.endpoint,))
        robots = life.enter_context(peer(run_robots, trial.kind, network, 4, 0, 0))
        robots.request("burst", HISTORY)
        watching = trial.observer()
        wait(watching, lambda now: total(now) >= 4 * HISTORY, 6.0)
    robots = trial.robots(4, incarnation=1)
    robots.request("burst", HISTORY)
    report = wait(watching, lambda now: total(now) >= 8 * HISTORY, 8.0)
    lives = [sum(n for (_, life), n in report.events.items() if life == at) for at in (0, 1)]
    yield (
        "restart: events of old + new incarnation",
        f"{lives[0]} + {lives[1]} of 4000 + 4000, {report.missed} shown as lost",
    )
    robots.request("reconnect")
    time.sleep(0.5)
    late = trial.observer()
    report = wait(late, lambda now: total(now) >= 4 * HISTORY, 2.0)
    yield "new session, same incarnation: history", f"{total(report)} of {4 * HISTORY}"


def pause(trial: Trial, seconds: float) -> Iterator[Row]:
    robots = trial.robots(4)
    observer = trial.observer()
    robots.request("rate", 200.0)
    time.sleep(1.0)
    with stopped(observer):
        time.sleep(seconds)
    resumed_s = time.monotonic()
    time.sleep(1.0)
    robots.request("rate", 0.0)
    published = robots.request("report")
    report = wait(observer, lambda now: total(now) >= published.published, 4.0)
    took_s = time.monotonic() - resumed_s
    yield (
        f"observer stopped {seconds:g} s, 4 robots at 200/s",
        f"{total(report)} of {published.published} after {took_s:.1f} s,"
        f" {report.missed} shown as lost; longest put {published.max_put_ms:.0f} ms",
    )


def cut(trial: Trial) -> Iterator[Row]:
    robots = trial.robots(4)
    robots.request("report")
    observer = trial.observer_through_proxy(1.0)
    robots.request("rate", 200.0)
    time.sleep(4.0)
    robots.request("rate", 0.0)
    published = robots.request("report").published
    report = wait(observer, lambda now: total(now) >= published, 3.0)
    yield (
        "link cut every second, 4 robots at 200/s",
        format_arrival(report, published),
    )


def cost(trial: Trial) -> Iterator[Row]:
    robots = trial.robots(1)
    bare = robots.request("report")
    robots.request("burst", CACHE)
    full = robots.request("report")
    yield (
        "cost of 10,000 events of one robot",
        f"{full.put_us:.1f} us each, memory {full.rss_mib - bare.rss_mib:+.1f} MiB"
        f" (of {full.rss_mib:.0f}), {full.threads} threads",
    )
    observer = trial.observer(0)
    observer.request("report")
    robots.request("report")
    robots.request("rate", 300.0)
    time.sleep(1.5)
    robots.request("rate", 0.0)
    report = robots.request("report")
    got = total(wait(observer, lambda now: total(now) >= report.published, 1.0))
    yield (
        "  with an observer, at 300/s",
        f"{report.put_us:.1f} us each ({got} of {report.published} arrive)",
    )


def rest(trial: Trial) -> Iterator[Row]:
    robots, observer = trial.robots(32), trial.observer()
    observer.request("report")
    robots.request("burst", 1)
    time.sleep(1.0)
    before, used = observer.request("report"), robots.request("report")
    time.sleep(2.5)
    after, now = observer.request("report"), robots.request("report")
    per_s = (after.received_bytes - before.received_bytes) / 2.5 / 32.0
    of = (
        "states, each with the last number" if trial.kind == "ours" else "heartbeats, beside states"
    )
    yield (
        "32 robots at rest, to each observer",
        f"{per_s:.0f} bytes/s each ({of}), CPU robots {(now.cpu_s - used.cpu_s) / 2.5:.1%},"
        f" {now.threads} threads",
    )


def leave(trial: Trial) -> Iterator[Row]:
    trial.robots(4)
    observer = trial.observer()
    observer.request("report")
    observer.send("leave")
    begun_s = time.monotonic()
    has_left = observer.connection.poll(5.0)
    took_s = time.monotonic() - begun_s
    yield (
        "observer closes its session and ends",
        f"in {took_s:.2f} s" if has_left else "still running after 5 s",
    )


TRIALS: dict[str, Callable[[Trial], Iterator[Row]]] = {
    "late-4": lambda trial: late_observer(trial, 4),
    "late-50": lambda trial: late_observer(trial, 50),
    "late-link": late_link,
    "watched": watched,
    "restart": restart,
    "pause": lambda trial: pause(trial, 5.0),
    "cut": cut,
    "cost": cost,
    "rest": rest,
    "leave": leave,
    "forge-gap": lambda trial: deaf(trial, "forge_gap"),
    "forge-heartbeats": lambda trial: deaf(trial, "forge_heartbeats"),
    "claim": lambda trial: deaf(trial, "claim_incarnation"),
    "flood": flood,
    "impersonate": impersonate,
    "silence": silence,
    "sources": lambda trial: memory(trial, "make_up_sources"),
    "hold": lambda trial: memory(trial, "hold"),
}


def main() -> None:
    started_s = time.monotonic()
    for name in sys.argv[1:] or TRIALS:
        if time.monotonic() - started_s > MAX_S:
            print(f"{name}: skipped, after {MAX_S:g} s")
            continue
        rows: list[list[Row]] = []
        for kind in KINDS:
            with ExitStack() as stack:
                try:
                    rows.append(list(TRIALS[name](Trial(kind, stack))))
                except AssertionError as error:
                    rows.append([(name, f"failed: {error}")])
        for (what, ours), (_, zenohs) in zip(*rows, strict=False):
            print(f"{what}\n    ours:  {ours}\n    zenoh: {zenohs}", flush=True)
    print(f"in {time.monotonic() - started_s:.0f} s")


if __name__ == "__main__":
    main()
