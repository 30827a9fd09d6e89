"""Robots and bodies on one machine share memory: real processes are killed and restarted, and nothing is left."""

import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from tests.support.process import Process, Robot, wait_until
from tests.support.process_colony import Colony, colony, settings

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="there are no such links here")

MEMORY = re.compile(r" (\d+) +/memfd:crcolony ")
"""An inode of shared memory, in a process's list of what it has mapped"""
ADDRESS = re.compile(r" (\d+) (@crcolony/\d+/arena/\d+)$", re.MULTILINE)
"""The inode of an arena's socket, and its address"""
TOKEN_S = 5.0
"""A process that is killed is offline after this time at the latest"""


def memory_of(pid: int) -> set[int]:
    """Return the inodes of the shared memory that a process has mapped."""
    try:
        return {int(inode) for inode in MEMORY.findall(Path(f"/proc/{pid}/maps").read_text())}
    except OSError:  # it has ended
        return set()


def addresses_of(pid: int) -> set[str]:
    """Return the addresses of arenas at which a process listens, or which it has connected."""
    links = [os.readlink(path) for path in Path(f"/proc/{pid}/fd").iterdir() if path.is_symlink()]
    listed = ADDRESS.findall(Path("/proc/net/unix").read_text())
    return {address for inode, address in listed if f"socket:[{inode}]" in links}


def who_has(memory: int) -> list[int]:
    """Return the processes of this machine that have this memory."""
    return [process.pid for process in psutil.process_iter() if memory in memory_of(process.pid)]


def generations(robot: Robot) -> int:
    """Return how many generations it has completed since its start."""
    return robot.output.count("\ngeneration ")


def wait_for_sharing(arena: Process, *robots: Robot) -> int:
    """Wait until these have the arena's memory; return its inode."""
    wait_until(
        lambda: all(memory_of(robot.pid) & memory_of(arena.pid) for robot in robots),
        "all robots share memory with their arena",
        60.0,
    )
    (memory,) = memory_of(arena.pid)
    return memory


def wait_for_generations(robot: Robot, count: int = 2, within_s: float = 30.0) -> None:
    """Wait until a robot has completed more generations."""
    before = generations(robot)
    wait_until(lambda: generations(robot) >= before + count, "it lives on", within_s)


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Colony]:
    """An arena in lockstep and two robots."""
    with colony(tmp_path_factory.mktemp("colony")) as made:
        made.arena(2, "--lockstep", "--expect", "2")
        for _ in range(2):
            made.robot("--snapshot", "1")
        yield made


def test_robots_and_their_arena_share_memory(running: Colony) -> None:
    """One memory for all, and they live by it."""
    (arena,) = running.arenas
    wait_for_sharing(arena, *running.robots)
    for robot in running.robots:
        wait_for_generations(robot)


def test_a_robot_that_is_killed_does_not_stall_the_others(running: Colony) -> None:
    """Longer than its token takes to end; it comes back, and shares memory again."""
    (arena,), (victim, other) = running.arenas, running.robots
    memory = wait_for_sharing(arena, victim, other)
    victim.kill()
    wait_for_generations(other, 1, within_s=TOKEN_S)
    victim.start()
    assert wait_for_sharing(arena, victim, other) == memory
    for robot in (victim, other):
        wait_for_generations(robot)


def test_an_arena_that_is_killed_leaves_nothing_behind(running: Colony) -> None:
    """No socket, no file, no memory; robots wait, and go on with the next arena as the same processes."""
    (arena,), robots = running.arenas, running.robots
    memory = wait_for_sharing(arena, *robots)
    (address,) = addresses_of(arena.pid)
    wait_until((running.folder / "arena" / "arena.npz").exists, "the arena is saved")
    pids = [robot.pid for robot in robots]
    arena.kill()
    for robot in robots:
        robot.wait_for("the arena is offline", within_s=TOKEN_S)
    wait_until(lambda: address not in Path("/proc/net/unix").read_text(), "no socket is left", 5.0)
    arena.start()
    assert wait_for_sharing(arena, *robots) != memory
    for robot in robots:
        wait_for_generations(robot)
    wait_until(lambda: not who_has(memory), "nobody has the former memory", 10.0)
    assert [robot.pid for robot in robots] == pids
    assert not list(Path("/dev/shm").glob("*crcolony*"))


def test_robots_that_share_memory_stop_as_they_should(running: Colony) -> None:
    """Though they only wait for bells; afterwards nobody has the memory."""
    (arena,), robots = running.arenas, running.robots
    memory = wait_for_sharing(arena, *robots)
    for process in (*robots, arena):
        process.stop()
        assert "Traceback" not in process.output
    assert not who_has(memory)


@pytest.mark.parametrize("link", ["shared memory", "network"])
def test_the_robots_of_a_launch_share_memory_unless_told_not_to(tmp_path: Path, link: str) -> None:
    """With --no-shared-memory nothing is shared, and they live as well."""
    logs = [tmp_path / "run" / "logs" / f"robot-{number}.log" for number in range(2)]
    more = ["--no-shared-memory"] if link == "network" else []
    with colony(tmp_path) as made:
        options = ("-n", "2", "--lockstep", "--no-plots", *settings(), *more)
        launched = made.start("launch", "launch", *options, "--out", str(tmp_path / "run"))
        launched.wait_for("2 robots are connected")
        wait_until(
            lambda: all(log.exists() and "generation 2" in log.read_text() for log in logs),
            "the robots live",
        )
        robots = [
            child for child in psutil.Process(launched.pid).children() if "robot" in child.cmdline()
        ]
        assert len(robots) == 2
        assert all(bool(memory_of(robot.pid)) == (link == "shared memory") for robot in robots)
        launched.stop()
