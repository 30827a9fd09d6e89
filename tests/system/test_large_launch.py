"""More robots than a mesh carries: the launch starts a router, and nobody is lost."""

import time
from pathlib import Path

import psutil
import pytest

from crcolony.transport.network_settings import MAX_MESH_ROBOTS
from tests.support.process import wait_until
from tests.support.process_colony import View, colony

ROBOTS = MAX_MESH_ROBOTS + 8
OWN_MIB = 22.0
"""Of a robot, with room for what differs from machine to machine; a new interpreter has 33 to 36 of its own"""


def wait_until_all_see_all(view: View) -> None:
    """Wait until every robot says, from now on, that it sees all others."""
    since_unix_s = time.time()

    def is_so() -> bool:
        robots = list(view.update().states)
        return len(robots) == ROBOTS and view.have_peers(robots, ROBOTS - 1, since_unix_s)

    wait_until(is_so, "all see all others")


def word_after(option: str, words: list[str]) -> str:
    """Return the value of an option of a command line."""
    return words[words.index(option) + 1]


@pytest.mark.parametrize("is_given", [False, True], ids=["on loopback", "where --listen says"])
def test_many_robots_see_each_other_through_a_router(tmp_path: Path, is_given: bool) -> None:
    """The router that the launch has started may die; the terminal shows nothing but what happened."""
    with colony(tmp_path) as made:
        listen = ["--listen", made.endpoint] if is_given else []
        launched = made.start(
            "launch", "launch", "--no-plots", "-n", str(ROBOTS), "--hz", "2", *listen,
            "--out", str(tmp_path / "run"),
        )  # fmt: skip
        launched.wait_for(f"{ROBOTS} robots are connected")
        children = psutil.Process(launched.pid).children()
        clients = [child for child in children if "--client" in child.cmdline()]
        robots = [child for child in clients if "robot" in child.cmdline()]
        (router,) = [child for child in children if "router" in child.cmdline()]
        assert (len(robots), len(clients)) == (ROBOTS, ROBOTS + 1), "and the arena"
        view = made.observer("--connect", word_after("--listen", router.cmdline()))
        wait_until_all_see_all(view)
        router.kill()
        launched.wait_for("router is restarted")
        wait_until_all_see_all(view)
        assert max(robot.memory_full_info().uss / 2**20 for robot in robots) < OWN_MIB
        launched.stop()
        said = launched.output
    assert not any(word in said for word in ("robot 0", "panicked", "ERROR", "WARN", "Traceback"))
