"""Whether Zenoh's advanced publishers could replace our event buffer, sequence gaps, back-fill and history queries.

Run with `python -m tests.benchmarks.bench_advanced_pubsub [trial ...]`; it takes under three minutes.
Every trial runs twice, with ours and with `zenoh.ext`, between processes of this machine; docs/advanced_pubsub.md says
what follows from the figures.
"""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack

from crcolony.transport.zenoh_session import NetworkSettings
from tests.benchmarks.advanced_pubsub_attacks import OTHER, VICTIM
from tests.benchmarks.advanced_pubsub_robots import CACHE, Kind, run_robots
from tests.benchmarks.advanced_pubsub_trial import (
    HISTORY,
    Trial,
    format_arrival,
    format_load,
    peer,
    stopped,
    total,
    wait,
)

MAX_S = 165.0
"""Trials that have not begun by then are skipped: the machine is too busy."""
KINDS: tuple[Kind, Kind] = ("ours", "zenoh")
Row = tuple[str, str]
"""What was measured, and the figure"""


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


def deaf(trial: Trial, attack: str) -> Iterator[Row]:
    robots, observer = trial.robots(2), trial.observer()
    attacker = trial.attacker(attack)
    robots.request("burst", 50)
    wait(observer, lambda now: total(now) >= 100, 5.0)
    attacker.send("attack")
    while not attacker.connection.poll(0.0):  # it waits for an event of the victim
        robots.request("burst", 1)
        time.sleep(0.02)
    time.sleep(0.5)
    before, used = observer.request("report"), robots.request("report")
    robots.request("burst", 100)
    time.sleep(1.0)
    after, report = observer.request("report"), robots.request("report")
    got = after.events[VICTIM, 0] - before.events[VICTIM, 0]
    yield (
        f"{attack}: 100 events afterwards",
        f"{got} arrive; lost shown {after.missed}; CPU robots"
        f" {(report.cpu_s - used.cpu_s) / (report.at_s - used.at_s):.0%}, observer"
        f" {(after.cpu_s - before.cpu_s) / (report.at_s - used.at_s):.0%}",
    )


def flood(trial: Trial) -> Iterator[Row]:
    robots = trial.robots(2)
    robots.request("burst", CACHE)
    observer = trial.observer(0)
    attacker = trial.attacker("flood")
    robots.request("rate", 20.0)
    time.sleep(1.0)
    seen, before = observer.request("report"), robots.request("report")
    attacker.request("attack")
    time.sleep(3.0)
    after = robots.request("report")
    shots = attacker.request("report")
    yield f"flood of history queries ({shots / 3:.0f}/s)", format_load(before, after)
    with stopped(attacker):
        time.sleep(2.0)
        stalled, now = robots.request("report"), observer.request("report")
    yield "the flooding peer then reads nothing", format_load(after, stalled)
    published = after.published + stalled.published
    yield (
        "  events published in these 5 s, and observed",
        f"{published} of 200, {total(now) - total(seen)} observed",
    )


def impersonate(trial: Trial) -> Iterator[Row]:
    robots = trial.robots(2)
    robots.request("burst", 10)
    attacker = trial.attacker("impersonate")
    attacker.request("attack")
    observer = trial.observer()
    observer.request("report")
    time.sleep(2.0)
    events = observer.request("report")
    made_up = {robot: max(0, events.events.get((robot, 0), 0) - 10) for robot in (VICTIM, OTHER)}
    yield (
        "impostor answers for one robot: forged events",
        f"{made_up[VICTIM]} of it, {made_up[OTHER]} of another robot",
    )


def silence(trial: Trial) -> Iterator[Row]:
    robots = trial.robots(2)
    robots.request("burst", 100)
    attacker = trial.attacker("silence")
    attacker.request("attack")
    observer = trial.observer()
    report = wait(observer, lambda now: total(now) >= 200, 3.0)
    first = f"first after {report.first_s:.1f} s" if total(report) else "none in 3 s"
    yield "silent impostor: late observer's history", f"{total(report)} of 200, {first}"
    late = trial.robots(1, first=2)
    late.request("rate", 20.0)
    begun_s = time.monotonic()
    report = wait(observer, lambda now: len(now.events) > 2, 3.0)
    took = f"after {time.monotonic() - begun_s:.1f} s"
    yield (
        "  first event of a robot that starts then",
        took if len(report.events) > 2 else "none in 3 s",
    )


def memory(trial: Trial, attack: str) -> Iterator[Row]:
    robots, observer = trial.robots(1), trial.observer()
    attacker = trial.attacker(attack)
    robots.request("burst", 10)
    time.sleep(0.5)
    before = observer.request("report")
    attacker.send("attack")
    peak = 0.0
    done_s = 0.0
    started_s = time.monotonic()
    while time.monotonic() - started_s < 20.0:
        report = observer.request("report")
        peak = max(peak, report.rss_mib)
        if not done_s and attacker.connection.poll(0.0):
            done_s = time.monotonic()
        if done_s and time.monotonic() - done_s > 1.5:
            break
        time.sleep(0.05)
    yield (
        f"{attack}: observer's memory",
        f"peak {peak - before.rss_mib:+.0f} MiB, {report.rss_mib - before.rss_mib:+.0f} MiB afterwards",
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
