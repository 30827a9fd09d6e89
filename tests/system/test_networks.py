"""The ways to be on the network: multicast, routers that stand in for each other, colonies and arenas, a host."""

from collections.abc import Sequence
from pathlib import Path

from crcolony.results.merged_history import merge_robot_files
from crcolony.storage.reading import read_stored_robot
from crcolony.transport.zenoh_session import free_port
from tests.support.mating_audit import check_ledger
from tests.support.namespaces import hosts, needs_namespaces
from tests.support.process import wait_until
from tests.support.process_colony import Colony, colony, settings, settle

CLOCK = ("--hz", "30")


def partners(made: Colony, robot: int) -> set[bytes]:
    """Return who a robot has mated with, as its memory has it."""
    memory = read_stored_robot(made.robots[robot].memory)
    return {record.peer for record, decision in memory.matings if decision is not None}


@needs_namespaces
def test_robots_of_a_lan_find_each_other_by_multicast(tmp_path: Path) -> None:
    """`--interface` alone: nobody is told an address; all see all, and they mate across machines."""
    with hosts(3) as lan, colony(tmp_path) as made:
        by_multicast = ("--interface", "eth0")
        made.arena(2, *CLOCK, *by_multicast, before=lan[0].before)
        for host in lan[1:]:
            made.robot(*by_multicast, before=host.before)
        view = made.observer(*by_multicast, before=lan[0].before)
        settle(made, view)
        view.wait_for_matings(2)
        made.calm_down(view)
        check_ledger(made.memories)


def test_the_colony_goes_on_when_one_of_two_routers_is_killed(tmp_path: Path) -> None:
    """Arena and robots are clients that know both routers; with one of them dead they still see each other and mate."""
    one, other = (f"tcp/127.0.0.1:{free_port()}" for _ in range(2))
    reach = ("--client", "--connect", one, "--connect", other)
    with colony(tmp_path) as made:
        first = made.start("first", "router", "--listen", one)
        second = made.start("second", "router", "--listen", other, "--connect", one)
        for router in (first, second):
            router.wait_for("router at")
        made.arena(3, *CLOCK, *reach)
        for _ in range(3):
            made.robot(*reach)
        view = made.observer("--connect", other)
        settle(made, view)
        view.wait_for_matings(2)
        first.kill()
        settle(made, view)
        view.wait_for_matings(4)
        assert all(robot.is_running for robot in made.robots)
        made.calm_down(view)
        check_ledger(made.memories)


def test_two_colonies_share_an_arena_and_never_mate_across(tmp_path: Path) -> None:
    """Their bodies are in one arena, but every mating is within a colony, and each sees only its own."""
    with colony(tmp_path) as made:
        made.arena(4, *CLOCK)
        for name in ("reds", "reds", "blues", "blues"):
            made.robot("--colony", name)
        view = made.observer()
        reds, blues = made.ids[:2], made.ids[2:]

        def are_settled() -> bool:
            states = view.fresh(made.ids)
            return len(states) == 4 and all(state.arena and state.peers == 1 for state in states)

        wait_until(are_settled, "all have bodies, and each sees the other of its colony")
        for robot in made.ids:
            view.wait_for_matings(2, robot)
        made.calm_down(view)
        check_ledger(made.memories)
        for number, other in ((0, reds[1]), (1, reds[0]), (2, blues[1]), (3, blues[0])):
            assert partners(made, number) == {other}


def test_one_colony_lives_in_two_arenas(tmp_path: Path) -> None:
    """All four robots see each other, two bodies are in each arena, and matings are within an arena."""
    with colony(tmp_path) as made:
        elsewhere = f"tcp/127.0.0.1:{free_port()}"
        made.arena(2, *CLOCK, name="one")
        made.arena(2, *CLOCK, "--listen", elsewhere, "--connect", made.endpoint, name="two")
        for name in ("one", "one", "two", "two"):
            made.robot("--arena", name)
        view = made.observer()
        settle(made, view)
        assert [view.states[robot].arena for robot in made.ids] == ["one", "one", "two", "two"]
        for robot in made.ids:
            view.wait_for_matings(2, robot)
        made.calm_down(view)
        check_ledger(made.memories)
        for number, other in ((0, 1), (1, 0), (2, 3), (3, 2)):
            assert partners(made, number) == {made.ids[other]}


def hosted(made: Colony, folder: Path, count: int) -> Sequence[Path]:
    """Return the memories of hosted robots."""
    memories = [folder / "robots" / str(number) / "robot.sqlite" for number in range(count)]
    assert all(memory.exists() for memory in memories), made.folder
    return memories


def test_hosted_robots_mate_with_robots_of_other_processes(tmp_path: Path) -> None:
    """Twenty robots in one process, two in processes of their own, one arena: all see all, and mate both ways."""
    with colony(tmp_path) as made:
        host = made.start(
            "host", "host", "-n", "20", *settings(), *CLOCK,
            "--listen", made.endpoint, "--out", str(tmp_path / "host"),
        )  # fmt: skip
        host.wait_for("and 8 places for others")
        for _ in range(2):
            made.robot()
        view = made.observer()

        def are_settled() -> bool:
            states = view.fresh(sorted(view.alive()))
            return len(states) == 22 and all(state.arena and state.peers == 21 for state in states)

        wait_until(are_settled, "22 robots have bodies and see each other")
        for robot in made.ids:
            view.wait_for_matings(2, robot)
        made.stop_robots()
        host.stop()
        memories = hosted(made, tmp_path / "host", 20)
        check_ledger([*made.memories, *memories], is_calm=False)
        assert len(merge_robot_files([*made.memories, *memories]).robots) == 22
        own = set(made.ids)
        assert all(partners(made, number) - own for number in range(2))
