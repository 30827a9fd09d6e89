"""The ways to connect: multicast, interchangeable routers, several colonies or arenas, a host of many robots."""

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
    """Return the robots that a robot has mated with, by its store."""
    stored = read_stored_robot(made.robots[robot].store)
    return {record.peer for record, decision in stored.matings if decision is not None}


@needs_namespaces
def test_robots_of_a_lan_find_each_other_by_multicast(tmp_path: Path) -> None:
    """`--interface` alone, without addresses: all are connected, and they mate across hosts."""
    with hosts(3) as lan, colony(tmp_path) as made:
        by_multicast = ("--interface", "eth0")
        made.arena(2, *CLOCK, *by_multicast, before=lan[0].before)
        for host in lan[1:]:
            made.robot(*by_multicast, before=host.before)
        view = made.observer(*by_multicast, before=lan[0].before)
        settle(made, view)
        view.wait_for_matings(2)
        made.finish(view)
        check_ledger(made.stores)


def test_the_colony_continues_when_one_of_two_routers_is_killed(tmp_path: Path) -> None:
    """Arena and robots are clients of both routers; with one of them killed they are still connected and mate."""
    one, other = (f"tcp/127.0.0.1:{free_port()}" for _ in range(2))
    network = ("--client", "--connect", one, "--connect", other)
    with colony(tmp_path) as made:
        first = made.start("first", "router", "--listen", one)
        second = made.start("second", "router", "--listen", other, "--connect", one)
        for router in (first, second):
            router.wait_for("router at")
        made.arena(3, *CLOCK, *network)
        for _ in range(3):
            made.robot(*network)
        view = made.observer("--connect", other)
        settle(made, view)
        view.wait_for_matings(2)
        first.kill()
        settle(made, view)
        view.wait_for_matings(4)
        assert all(robot.is_running for robot in made.robots)
        made.finish(view)
        check_ledger(made.stores)


def test_two_colonies_share_an_arena_and_never_mate_across(tmp_path: Path) -> None:
    """Their bodies are in one arena, but every mating is within a colony, and peers are only of the own colony."""
    with colony(tmp_path) as made:
        made.arena(4, *CLOCK)
        for name in ("reds", "reds", "blues", "blues"):
            made.robot("--colony", name)
        view = made.observer()
        reds, blues = made.ids[:2], made.ids[2:]

        def are_settled() -> bool:
            states = view.fresh(made.ids)
            return len(states) == 4 and all(state.arena and state.peers == 1 for state in states)

        wait_until(are_settled, "all have bodies, and the other robot of their colony as peer")
        for robot in made.ids:
            view.wait_for_matings(2, robot)
        made.finish(view)
        check_ledger(made.stores)
        for number, other in ((0, reds[1]), (1, reds[0]), (2, blues[1]), (3, blues[0])):
            assert partners(made, number) == {other}


def test_one_colony_has_bodies_in_two_arenas(tmp_path: Path) -> None:
    """All four robots are connected, two bodies are in each arena, and matings are within an arena."""
    with colony(tmp_path) as made:
        other_endpoint = f"tcp/127.0.0.1:{free_port()}"
        made.arena(2, *CLOCK, name="one")
        made.arena(2, *CLOCK, "--listen", other_endpoint, "--connect", made.endpoint, name="two")
        for name in ("one", "one", "two", "two"):
            made.robot("--arena", name)
        view = made.observer()
        settle(made, view)
        assert [view.states[robot].arena for robot in made.ids] == ["one", "one", "two", "two"]
        for robot in made.ids:
            view.wait_for_matings(2, robot)
        made.finish(view)
        check_ledger(made.stores)
        for number, other in ((0, 1), (1, 0), (2, 3), (3, 2)):
            assert partners(made, number) == {made.ids[other]}


def hosted_stores(made: Colony, folder: Path, count: int) -> Sequence[Path]:
    """Return the files of the stores of hosted robots."""
    stores = [folder / "robots" / str(number) / "robot.sqlite" for number in range(count)]
    assert all(store.exists() for store in stores), made.folder
    return stores


def test_hosted_robots_mate_with_robots_of_other_processes(tmp_path: Path) -> None:
    """Twenty robots in one process, two in processes of their own, one arena: all are connected, and mate both ways."""
    with colony(tmp_path) as made:
        host = made.start(
            "host", "host", "--no-plots", "-n", "20", *settings(), *CLOCK,
            "--listen", made.endpoint, "--out", str(tmp_path / "host"),
        )  # fmt: skip
        host.wait_for("and 8 slots for others")
        for _ in range(2):
            made.robot()
        view = made.observer()

        def are_settled() -> bool:
            states = view.fresh(sorted(view.alive()))
            return len(states) == 22 and all(state.arena and state.peers == 21 for state in states)

        wait_until(are_settled, "22 robots have bodies and are connected")
        for robot in made.ids:
            view.wait_for_matings(2, robot)

        def have_mated_across() -> bool:
            pairs = [{it.initiator, it.responder} for _, it in view.update().mated_encounters()]
            return all(any(robot in pair and pair - own for pair in pairs) for robot in own)

        own = set(made.ids)
        wait_until(have_mated_across, "each of the two has mated with a hosted robot")
        made.stop_robots()
        host.stop()
        hosted = hosted_stores(made, tmp_path / "host", 20)
        check_ledger([*made.stores, *hosted], is_settled=False)
        assert len(merge_robot_files([*made.stores, *hosted]).robots) == 22
        assert all(partners(made, number) - own for number in range(2))
