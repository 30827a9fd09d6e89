"""Processes die, freeze and come back at any moment; the colony evolves on, and the ledger stays exact."""

import random
import signal
import statistics
import time
from pathlib import Path

import psutil

from crcolony.colony.telemetry import Exchanged
from tests.system.colony import Colony, Process, View, colony, settings, settle, wait_until
from tests.system.ledger import check_ledger
from tests.system.observer import Happened, Stated

HZ = ("--hz", "30")


def test_sixty_kills_leave_an_exact_ledger(tmp_path: Path) -> None:
    """Six robots that mate several times a second are killed 60 times: nothing is lost, doubled, or left open."""
    chance = random.Random(60)
    with colony(tmp_path) as made:
        made.arena(6, *HZ)
        robots = [made.robot("--snapshot", "2") for _ in range(6)]
        view = made.observer()
        settle(made, view)
        before = view.mated()
        for _ in range(60):
            time.sleep(chance.uniform(0.2, 1.1))
            robot = chance.choice([r for r in robots if r.has_body] or robots)
            robot.kill()
            robot.start()
        during = view.mated() - before
        settle(made, view)
        made.stop_robots()
        assert during >= 60, "with so few matings this shows nothing"
        ledger = check_ledger([robot.memory for robot in robots])
        assert 2 * ledger.matings >= view.mated() and ledger.turnovers > 0
        told = [
            (line.told.robot, line.told.event.encounter)
            for line in view.lines
            if isinstance(line, Happened) and isinstance(line.told.event, Exchanged)
        ]
        assert len(set(told)) == len(told), "a robot decided twice about an encounter"
        for robot in robots:
            lives = view.lives[robot.id]
            assert len(lives) > 1 and lives == sorted(set(lives)), "a life is not newer than before"
        print(during, ledger)


def test_frozen_robots_hold_nobody_up_and_come_back(tmp_path: Path) -> None:
    """Three robots are frozen for 1, 5 and 15 s; the others keep their pace and mate on; all is well afterwards."""
    with colony(tmp_path) as made:
        made.arena(6, *HZ)
        robots = [made.robot() for _ in range(6)]
        view = made.observer()
        settle(made, view)
        frozen, others = robots[:3], [robot.id for robot in robots[3:]]
        before, since_s = len(view.lines), time.monotonic()
        for robot in frozen:
            robot.signal(signal.SIGSTOP)
        for robot, seconds in zip(frozen, (1.0, 5.0, 15.0), strict=True):
            time.sleep(since_s + seconds - time.monotonic())
            robot.signal(signal.SIGCONT)
        lines = view.update().lines[before:]
        periods = [
            line.state.period_ms
            for line in lines
            if isinstance(line, Stated) and line.state.robot in others
        ]
        matings = [
            line for line in lines
            if isinstance(line, Happened) and isinstance(line.told.event, Exchanged)
            and line.told.robot in others
        ]  # fmt: skip
        assert len(periods) > 60 and statistics.median(periods) < 2 * 1000 / 30
        assert len(matings) >= 10, "those that were not frozen mate on"
        print(len(periods), statistics.median(periods), max(periods), len(matings))
        settle(made, view)
        made.stop_robots()
        check_ledger([robot.memory for robot in robots])


def test_a_robot_that_is_told_to_stop_is_saved_and_gone_within_2_s(tmp_path: Path) -> None:
    """SIGTERM: exit code 0, its token goes, its memory holds the last tick, and it goes on from there."""
    with colony(tmp_path) as made:
        made.arena(2, *HZ)
        robot, other = made.robot(), made.robot()
        view = made.observer()
        settle(made, view)
        wait_until(lambda: view.mated() > 4, "they mate")
        assert robot.stop() < 2.0
        wait_until(lambda: not view.is_alive(robot.id), "its token goes", 2.0)
        assert "saved in generation" in robot.said
        tick = view.states[robot.id].tick
        robot.start()
        settle(made, view)
        assert view.states[robot.id].tick >= tick
        made.stop_robots()
        check_ledger([robot.memory, other.memory])


def test_an_arena_that_is_killed_and_started_again_is_found_by_its_robots(tmp_path: Path) -> None:
    """Nature dies: the robots live on without bodies, find the new arena, and evolve on, without being started again."""
    with colony(tmp_path) as made:
        arena = made.arena(4, *HZ)
        robots = [made.robot() for _ in range(4)]
        view = made.observer()
        settle(made, view)
        arena.kill()
        for robot in robots:
            robot.wait_for("the arena is gone", within_s=10.0)
        arena.start()
        for robot in robots:
            robot.wait_for("has body", count=2)
        settle(made, view)
        before = view.mated()
        wait_until(lambda: view.mated() > before + 4, "they mate again")
        arena.stop()
        arena.start()
        arena.wait_for("goes on from tick")
        for robot in robots:
            robot.wait_for("has body", count=3)
        settle(made, view)
        made.stop_robots()
        check_ledger([robot.memory for robot in robots])


def test_a_robot_killed_in_lockstep_is_not_waited_for(tmp_path: Path) -> None:
    """The others go on at once, and with it again when it is back."""
    with colony(tmp_path) as made:
        made.arena(3, "--lockstep", "--expect", "3")
        robots = [made.robot("--snapshot", "1") for _ in range(3)]
        view = made.observer()
        settle(made, view)
        robots[0].kill()
        wait_until(lambda: not view.is_alive(robots[0].id), "it is gone", 5.0)
        before = {robot.id: view.states[robot.id].tick for robot in robots}
        wait_until(
            lambda: all(
                view.update().states[robot.id].tick > before[robot.id] + 50 for robot in robots[1:]
            ),
            "the others go on",
        )
        assert view.states[robots[0].id].tick == before[robots[0].id]
        robots[0].start()
        settle(made, view)
        wait_until(
            lambda: view.update().states[robots[0].id].tick > before[robots[0].id] + 50,
            "it goes on, too",
        )
        made.stop_robots()
        check_ledger([robot.memory for robot in robots])


def child_of(launched: Process, *words: str) -> psutil.Process:
    """Return the process that `launch` started with these words."""
    (child,) = [
        child
        for child in psutil.Process(launched.pid).children()
        if set(words) <= set(child.cmdline())
    ]
    return child


def test_launch_starts_again_what_is_killed(tmp_path: Path) -> None:
    """A robot and the arena are killed; launch says so, and both go on; at the end the ledger is exact."""
    run = tmp_path / "run"
    with colony(tmp_path) as made:
        launched = made.start(
            "launch", "launch", "-n", "3", *HZ, *settings(), "--out", str(run)
        )
        launched.wait_for("3 robots see each other")
        child_of(launched, "robot", "--number", "1").kill()
        launched.wait_for("robot 1: killed by SIGKILL")
        launched.wait_for("robot 1 is started again")
        child_of(launched, "arena", "--hz").kill()
        launched.wait_for("arena is started again")
        for number in range(3):
            log = run / "logs" / f"robot-{number}.log"
            wait_until(lambda log=log: log.read_text().count("has body") > 1, f"{log} has a body")
        children = psutil.Process(launched.pid).children()
        assert len(children) == 4
        launched.stop()
        assert not any(child.is_running() for child in children)
        assert "history hash: " in launched.said
    check_ledger(sorted(run.glob("robots/*/memory.sqlite")))


def test_robots_wait_for_their_arena_and_take_in_a_late_joiner(tmp_path: Path) -> None:
    """Robots started before the arena get bodies when it comes; one that comes later is seen by all and mates."""
    with colony(tmp_path) as made:
        robots = [made.robot(), made.robot()]
        for robot in robots:
            assert robot.id
        made.arena(3, *HZ)
        view = made.observer()
        settle(made, view)
        late = made.robot()
        settle(made, view)
        wait_until(lambda: view.update().matings[late.id] > 0, "the late joiner mates")
        made.stop_robots()
        check_ledger([robot.memory for robot in made.robots])
