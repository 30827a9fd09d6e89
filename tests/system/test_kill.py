"""Processes crash, freeze and restart at any moment; the colony evolves on, and the ledger stays exact."""

import random
import signal
import statistics
import time
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from tests.support.mating_audit import check_ledger
from tests.support.observer import StateReceived
from tests.support.process import Process, wait_until
from tests.support.process_colony import Colony, View, colony, settings, settle

HZ = 30.0
CLOCK = ("--hz", str(HZ))


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Colony, View]]:
    """An arena of six slots, five robots and an observer, for several tests; afterwards their ledger is exact."""
    with colony(tmp_path_factory.mktemp("colony")) as made:
        made.arena(6, *CLOCK)
        for _ in range(5):
            made.robot()
        view = made.observer()
        yield made, view
        made.finish(view)
        check_ledger(made.stores)


@pytest.mark.alone
def test_thirty_kills_leave_an_exact_ledger(tmp_path: Path) -> None:
    """Six robots that mate several times a second are killed 30 times: no mating is lost, doubled, or left open."""
    chance = random.Random(60)
    with colony(tmp_path) as made:
        made.arena(6, *CLOCK)
        robots = [made.robot("--snapshot", "2") for _ in range(6)]
        view = made.observer()
        settle(made, view)
        first_line = len(view.lines)
        for _ in range(30):
            time.sleep(chance.uniform(0.2, 1.1))
            robot = chance.choice([robot for robot in robots if robot.has_body] or robots)
            robot.kill()
            robot.start()
        during = len(view.mated_encounters(first_line))
        settle(made, view)
        made.finish(view)
        ledger = check_ledger(made.stores)
        matings = view.mated_encounters()
        assert len(set(matings)) == len(matings), "a robot decided twice about an encounter"
        assert during >= 15, "with so few matings this shows nothing"
        assert 2 * ledger.matings >= len(matings)
        assert ledger.turnovers > 0
        for robot in robots:
            incarnations = view.incarnations[robot.id]
            assert len(incarnations) > 1
            assert incarnations == sorted(set(incarnations)), "incarnations increase"


@pytest.mark.alone
def test_frozen_robots_delay_no_others_and_recover(running: tuple[Colony, View]) -> None:
    """Three robots are frozen for 1, 5 and 15 s; the others keep their period and mate; afterwards all recover."""
    made, view = running
    settle(made, view)
    frozen, others = made.robots[:3], made.ids[3:]
    first_line, since_s = len(view.lines), time.monotonic()
    for robot in frozen:
        robot.signal(signal.SIGSTOP)
    for robot, seconds in zip(frozen, (1.0, 5.0, 15.0), strict=True):
        time.sleep(since_s + seconds - time.monotonic())
        robot.signal(signal.SIGCONT)
    states = [
        line.state for line in view.all(StateReceived, first_line) if line.state.robot in others
    ]
    assert len(states) >= 30
    assert statistics.median(state.period_ms for state in states) < 2 * 1000.0 / HZ
    assert sum(robot in others for robot, _ in view.mated_encounters(first_line)) >= 4
    settle(made, view)


@pytest.mark.alone
def test_a_robot_that_is_stopped_is_saved_and_exits_within_2_s(
    running: tuple[Colony, View],
) -> None:
    """SIGTERM: exit code 0, its token goes, its store has the last tick, and it resumes from there."""
    made, view = running
    settle(made, view)
    robot = made.robots[0]
    view.wait_for_matings(1, robot.id)
    assert robot.stop() < 2.0
    assert "saved in generation" in robot.output
    wait_until(lambda: not view.is_alive(robot.id), "its token goes", 2.0)
    before = view.states[robot.id]
    robot.start()
    settle(made, view)
    after = view.states[robot.id]
    assert (after.tick, after.matings) >= (before.tick, before.matings)


@pytest.mark.alone
def test_robots_return_to_an_arena_that_is_killed_and_restarted(
    running: tuple[Colony, View],
) -> None:
    """The robots run on without bodies, join the new arena, and evolve on as the same processes."""
    made, view = running
    settle(made, view)
    (arena,) = made.arenas
    wait_until((made.folder / "arena" / "arena.npz").exists, "the arena is saved")
    had = {robot.pid: robot.output.count("has body") for robot in made.robots}
    arena.kill()
    for robot in made.robots:
        robot.wait_for("the arena is offline", within_s=10.0)
    arena.start()
    for robot in made.robots:
        robot.wait_for("has body", had[robot.pid] + 1)
    settle(made, view)
    assert "resumes at tick" in arena.output
    view.wait_for_matings(4)


@pytest.mark.alone
def test_a_robot_that_joins_late_is_online_and_mates(running: tuple[Colony, View]) -> None:
    """It gets the free slot of the running arena."""
    made, view = running
    settle(made, view)
    late = made.robot()
    settle(made, view)
    view.wait_for_matings(1, late.id)


def test_robots_wait_for_their_arena_and_lockstep_does_not_wait_for_offline_robots(
    tmp_path: Path,
) -> None:
    """Robots get bodies when the arena starts; one is killed: the others continue, then with it again."""
    with colony(tmp_path) as made:
        robots = [made.robot("--snapshot", "1") for _ in range(3)]
        assert len(set(made.ids)) == 3
        made.arena(3, "--lockstep", "--expect", "3")
        view = made.observer()
        settle(made, view)
        robots[0].kill()
        wait_until(lambda: not view.is_alive(robots[0].id), "it is offline", 5.0)
        ticks = [view.states[robot].tick for robot in made.ids]

        def have_advanced(first: int) -> bool:
            view.update()
            return all(view.states[made.ids[k]].tick > ticks[k] + 50 for k in range(first, 3))

        wait_until(lambda: have_advanced(1), "the others continue")
        assert view.states[made.ids[0]].tick == ticks[0]
        robots[0].start()
        wait_until(lambda: have_advanced(0), "it continues, too")
        settle(made, view)
        made.finish(view)
        check_ledger(made.stores)


def child_of(launched: Process, *options: str) -> psutil.Process:
    """Return the process that `launch` started with these options."""
    (child,) = [
        child
        for child in psutil.Process(launched.pid).children()
        if set(options) <= set(child.cmdline())
    ]
    return child


def wait_for_bodies(run: Path, times: int) -> None:
    """Wait until each of three robots has had a body so many times."""
    logs = [run / "logs" / f"robot-{number}.log" for number in range(3)]
    wait_until(
        lambda: all(log.read_text().count("has body") >= times for log in logs),
        f"every robot has a body, time {times}",
    )


def test_launch_restarts_processes_that_are_killed(tmp_path: Path) -> None:
    """A robot and the arena are killed; launch prints it, and both resume; at the end the ledger is exact.

    So is the fork server, of which nobody takes notice: another one forks them.
    """
    run = tmp_path / "run"
    with colony(tmp_path) as made:
        options = ("-n", "3", *CLOCK, *settings(), "--out", str(run))
        launched = made.start("launch", "launch", "--no-plots", *options)
        launched.wait_for("3 robots are connected")
        wait_for_bodies(run, 1)
        first = child_of(launched, "fork", "server")
        victims = child_of(launched, "robot", "--number", "1"), child_of(launched, "arena", "--hz")
        for child in (first, *victims):
            child.kill()
        launched.wait_for("robot 1: killed by SIGKILL")
        launched.wait_for("robot 1 is restarted")
        launched.wait_for("arena is restarted")
        wait_for_bodies(run, 2)
        children = psutil.Process(launched.pid).children()
        assert len(children) == 5
        assert child_of(launched, "fork", "server") != first
        assert {child.cmdline()[0] for child in children} == {"crcolony"}, "all are forked"
        launched.stop()
        assert not any(child.is_running() for child in children)
        assert "history hash: " in launched.output
    check_ledger(sorted(run.glob("robots/*/robot.sqlite")), is_settled=False)
