"""Processes die, freeze and come back at any moment; the colony evolves on, and the ledger stays exact."""

import random
import signal
import statistics
import time
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from tests.support.mating_audit import check_ledger
from tests.support.observer import Stated
from tests.support.process import Process, wait_until
from tests.support.process_colony import Colony, View, colony, settings, settle

HZ = 30.0
CLOCK = ("--hz", str(HZ))


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Colony, View]]:
    """An arena of six places, five robots and an observer, for several tests; afterwards their ledger is exact."""
    with colony(tmp_path_factory.mktemp("colony")) as made:
        made.arena(6, *CLOCK)
        for _ in range(5):
            made.robot()
        view = made.observer()
        yield made, view
        made.calm_down(view)
        check_ledger(made.memories)


def test_sixty_kills_leave_an_exact_ledger(tmp_path: Path) -> None:
    """Six robots that mate several times a second are killed 60 times: nothing is lost, doubled, or left open."""
    chance = random.Random(60)
    with colony(tmp_path) as made:
        made.arena(6, *CLOCK)
        robots = [made.robot("--snapshot", "2") for _ in range(6)]
        view = made.observer()
        settle(made, view)
        begun = len(view.lines)
        for _ in range(60):
            time.sleep(chance.uniform(0.2, 1.1))
            robot = chance.choice([robot for robot in robots if robot.has_body] or robots)
            robot.kill()
            robot.start()
        during = len(view.mating_driver(begun))
        settle(made, view)
        made.calm_down(view)
        ledger = check_ledger(made.memories)
        message = view.mating_driver()
        assert len(set(message)) == len(message), "a robot decided twice about an encounter"
        assert during >= 20, "with so few matings this shows nothing"
        assert 2 * ledger.matings >= len(message)
        assert ledger.turnovers > 0
        for robot in robots:
            lives = view.incarnations[robot.id]
            assert len(lives) > 1
            assert lives == sorted(set(lives)), "every life is newer than the one before"


def test_frozen_robots_hold_nobody_up_and_come_back(running: tuple[Colony, View]) -> None:
    """Three robots are frozen for 1, 5 and 15 s; the others keep their pace and mate on; all is well afterwards."""
    made, view = running
    settle(made, view)
    frozen, others = made.robots[:3], made.ids[3:]
    begun, since_s = len(view.lines), time.monotonic()
    for robot in frozen:
        robot.signal(signal.SIGSTOP)
    for robot, seconds in zip(frozen, (1.0, 5.0, 15.0), strict=True):
        time.sleep(since_s + seconds - time.monotonic())
        robot.signal(signal.SIGCONT)
    states = [line.state for line in view.all(Stated, begun) if line.state.robot in others]
    assert len(states) >= 30
    assert statistics.median(state.period_ms for state in states) < 2 * 1000.0 / HZ
    assert sum(robot in others for robot, _ in view.mating_driver(begun)) >= 4
    settle(made, view)


def test_a_robot_that_is_told_to_stop_is_saved_and_gone_within_2_s(
    running: tuple[Colony, View],
) -> None:
    """SIGTERM: exit code 0, its token goes, its memory holds the last tick, and it goes on from there."""
    made, view = running
    settle(made, view)
    robot = made.robots[0]
    view.wait_for_matings(1, robot.id)
    assert robot.stop() < 2.0
    assert "saved in generation" in robot.said
    wait_until(lambda: not view.is_alive(robot.id), "its token goes", 2.0)
    before = view.states[robot.id]
    robot.start()
    settle(made, view)
    after = view.states[robot.id]
    assert (after.tick, after.matings) >= (before.tick, before.matings)


def test_an_arena_that_is_killed_and_started_again_is_found_by_its_robots(
    running: tuple[Colony, View],
) -> None:
    """Nature dies: the robots live on without bodies, find the new arena, and evolve on as the same processes."""
    made, view = running
    settle(made, view)
    (arena,) = made.arenas
    wait_until((made.folder / "arena" / "arena.npz").exists, "the arena is saved")
    had = {robot.pid: robot.said.count("has body") for robot in made.robots}
    arena.kill()
    for robot in made.robots:
        robot.wait_for("the arena is gone", within_s=10.0)
    arena.start()
    for robot in made.robots:
        robot.wait_for("has body", had[robot.pid] + 1)
    settle(made, view)
    assert "goes on from tick" in arena.said
    view.wait_for_matings(4)


def test_a_late_joiner_is_seen_by_all_and_mates(running: tuple[Colony, View]) -> None:
    """It gets the free place in the running arena."""
    made, view = running
    settle(made, view)
    late = made.robot()
    settle(made, view)
    view.wait_for_matings(1, late.id)


def test_robots_wait_for_their_arena_and_lockstep_does_not_wait_for_the_dead(
    tmp_path: Path,
) -> None:
    """Robots get bodies when the arena comes; one is killed: the others go on, and with it again when it is back."""
    with colony(tmp_path) as made:
        robots = [made.robot("--snapshot", "1") for _ in range(3)]
        assert len(set(made.ids)) == 3
        made.arena(3, "--lockstep", "--expect", "3")
        view = made.observer()
        settle(made, view)
        robots[0].kill()
        wait_until(lambda: not view.is_alive(robots[0].id), "it is gone", 5.0)
        ticks = [view.states[robot].tick for robot in made.ids]

        def go_on(first: int) -> bool:
            view.update()
            return all(view.states[made.ids[k]].tick > ticks[k] + 50 for k in range(first, 3))

        wait_until(lambda: go_on(1), "the others go on")
        assert view.states[made.ids[0]].tick == ticks[0]
        robots[0].start()
        wait_until(lambda: go_on(0), "it goes on, too")
        settle(made, view)
        made.calm_down(view)
        check_ledger(made.memories)


def child_of(launched: Process, *words: str) -> psutil.Process:
    """Return the process that `launch` started with these words."""
    (child,) = [
        child
        for child in psutil.Process(launched.pid).children()
        if set(words) <= set(child.cmdline())
    ]
    return child


def wait_for_bodies(run: Path, times: int) -> None:
    """Wait until each of three robots has had a body so often."""
    logs = [run / "logs" / f"robot-{number}.log" for number in range(3)]
    wait_until(
        lambda: all(log.read_text().count("has body") >= times for log in logs),
        f"every robot has a body, time {times}",
    )


def test_launch_starts_again_what_is_killed(tmp_path: Path) -> None:
    """A robot and the arena are killed; launch says so, and both go on; at the end the ledger is exact."""
    run = tmp_path / "run"
    with colony(tmp_path) as made:
        words = ("-n", "3", *CLOCK, *settings(), "--out", str(run))
        launched = made.start("launch", "launch", *words)
        launched.wait_for("3 robots see each other")
        wait_for_bodies(run, 1)
        doomed = child_of(launched, "robot", "--number", "1"), child_of(launched, "arena", "--hz")
        for child in doomed:
            child.kill()
        launched.wait_for("robot 1: killed by SIGKILL")
        launched.wait_for("robot 1 is started again")
        launched.wait_for("arena is started again")
        wait_for_bodies(run, 2)
        children = psutil.Process(launched.pid).children()
        assert len(children) == 4
        launched.stop()
        assert not any(child.is_running() for child in children)
        assert "history hash: " in launched.said
    check_ledger(sorted(run.glob("robots/*/robot.sqlite")), is_calm=False)
