"""The README's way to a colony on two machines, word for word, in two network namespaces with its addresses."""

import re
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

from crcolony.storage.reading import read_stored_robot
from tests.support.mating_audit import check_ledger
from tests.support.namespaces import Host, hosts, needs_namespaces
from tests.support.paths import ROOT
from tests.support.process import Process, wait_until
from tests.support.process_colony import Colony, View, colony, settings

pytestmark = needs_namespaces

SEED = ("--connect", "tcp/10.0.0.1:7447")


def commands() -> list[tuple[str, list[str]]]:
    """Return the machine and the arguments of every command of the README's section."""
    section = (ROOT / "README.md").read_text("utf-8").partition("\n## Two machines\n")[2]
    block = section.partition("```\n")[2].partition("```")[0]
    lines = [re.fullmatch(r"(here|there)\$ crcolony (.+)", line) for line in block.splitlines()]
    assert len(lines) == 4
    assert all(lines), block
    return [(line[1], shlex.split(line[2])) for line in lines if line]


def start(made: Colony, lan: Sequence[Host], *more: str) -> list[Process]:
    """Start the four commands on their machines, with more options for all but `top`."""
    machines = {"here": lan[0], "there": lan[1]}
    command = str(Path(sys.executable).with_name("crcolony"))
    processes = []
    for number, (machine, arguments) in enumerate(commands()):
        extra = more if arguments[0] != "top" else ()
        log = made.folder / f"{number}-{arguments[0]}.log"
        process = Process([command, *arguments, *extra], log, machines[machine].before, made.folder)
        made.processes.append(process.start())
        processes.append(process)
    return processes


def wait_for_four(view: View) -> list[bytes]:
    """Wait until four robots are online, with bodies and connected; return their ids."""
    wait_until(
        lambda: len(view.alive()) == 4 and view.are_connected(sorted(view.alive())),
        "four robots are connected",
    )
    return sorted(view.alive())


def test_the_four_commands_of_the_readme_make_one_colony_on_two_machines(tmp_path: Path) -> None:
    """Run exactly as printed: 4 robots with bodies in one arena, and the table there shows them."""
    with hosts(2) as lan, colony(tmp_path) as made:
        arena, here, there, top = start(made, lan)
        view = made.observer(*SEED, before=lan[1].before)
        robots = wait_for_four(view)
        assert {view.states[robot].arena for robot in robots} == {"arena"}
        assert arena.output.count("gets slot") == 4
        top.wait_for("4 robots alive   arena arena: tick")
        for process in (here, there, top, arena):
            process.stop()


def test_robots_of_the_two_machines_mate_with_each_other(tmp_path: Path) -> None:
    """The same commands in a crowded arena: a robot here and one there have a mating, and the ledger is exact."""
    with hosts(2) as lan, colony(tmp_path) as made:
        arena, here, there, top = start(made, lan, *settings("robots=4"))
        view = made.observer(*SEED, before=lan[0].before)
        wait_for_four(view)
        stores = {
            machine: sorted(tmp_path.glob(f"runs/{machine}/robots/*/robot.sqlite"))
            for machine in ("here", "there")
        }
        ids_there = {read_stored_robot(path).robot for path in stores["there"]}

        def has_mated_across() -> bool:
            return any(
                record.peer in ids_there and record.state == "mated"
                for path in stores["here"]
                for record, _ in read_stored_robot(path).matings
            )

        wait_until(has_mated_across, "a robot here mates with one there")
        for process in (here, there, top, arena):
            process.stop()
        check_ledger([*stores["here"], *stores["there"]], is_settled=False)
