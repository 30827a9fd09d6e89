"""Trials of Zenoh's advanced publishers, and of our event history, among hostile peers."""

import time
from collections.abc import Iterator

from tests.benchmarks.advanced_pubsub_attacks import OTHER, VICTIM
from tests.benchmarks.advanced_pubsub_robots import CACHE
from tests.benchmarks.advanced_pubsub_trial import Row, Trial, format_load, stopped, total, wait


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
