"""Distribution changes nothing: processes over Zenoh and a single process have the same history."""

import json
from pathlib import Path

import pytest

from tests.support.process import Process
from tests.support.process_colony import colony, settings

OPTIONS = (*settings("generations=2"), "--seed", "3", "--no-plots")


@pytest.fixture(scope="module")
def in_process(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The history hash of an in-process colony, by the way in which its robots reproduce."""
    folder = tmp_path_factory.mktemp("in_process")
    with colony(folder) as made:
        evolved = {
            selection: made.start(f"evolve {selection}", "evolve", *options_of(selection, folder))
            for selection in ("implicit", "medea")
        }
        return {name: history_hash(process, folder / name) for name, process in evolved.items()}


def options_of(selection: str, folder: Path) -> tuple[str, ...]:
    """Return the options of an `evolve` into a folder of that name."""
    out = str(folder / selection)
    return ("--robots", "4", *OPTIONS, "--selection", selection, "--out", out)


def history_hash(process: Process, out: Path) -> str:
    """Return the history hash of a run when it has ended, which is also what it printed last."""
    assert process.wait(120.0) == 0, process.output
    history_hash = json.loads((out / "run.json").read_text())["history_hash"]
    assert process.output.splitlines()[-1] == f"history hash: {history_hash}"
    return str(history_hash)


@pytest.mark.parametrize(
    ("selection", "link"),
    [("implicit", "shared memory"), ("implicit", "network"), ("medea", "shared memory")],
)
def test_a_lockstep_colony_has_the_history_of_an_in_process_one(
    tmp_path: Path, in_process: dict[str, str], selection: str, link: str
) -> None:
    """`launch --lockstep` and `evolve` end with the same history hash, whether robots share memory with their bodies
    or not, in each way of selection that robots as processes know, and several matings are in it."""
    out = tmp_path / "launched"
    more = ["--no-shared-memory"] if link == "network" else []
    more += ["--set", f"selection={selection}"]
    with colony(tmp_path) as made:
        options = ("-n", "4", "--lockstep", *OPTIONS, *more, "--out", str(out))
        launched = made.start("launch", "launch", *options)
        assert history_hash(launched, out) == in_process[selection]
    matings = launched.output.partition(" matings led to")[0].split()[-1]
    assert int(matings) >= 5, "with so few matings this shows nothing"
