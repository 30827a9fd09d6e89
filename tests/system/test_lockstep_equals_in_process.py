"""Distribution changes nothing: processes over Zenoh and a single process have the same history."""

import json
from pathlib import Path

import pytest

from tests.support.process import Process
from tests.support.process_colony import colony, settings

OPTIONS = (*settings("generations=2"), "--seed", "3", "--no-plots")


@pytest.fixture(scope="module")
def in_process(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The history hash of an in-process colony."""
    folder = tmp_path_factory.mktemp("in_process")
    out = folder / "evolved"
    with colony(folder) as made:
        options = ("--robots", "4", *OPTIONS, "--out", str(out))
        return history_hash(made.start("evolve", "evolve", *options), out)


def history_hash(process: Process, out: Path) -> str:
    """Return the history hash of a run when it has ended, which is also what it printed last."""
    assert process.wait(120.0) == 0, process.output
    history_hash = json.loads((out / "run.json").read_text())["history_hash"]
    assert process.output.splitlines()[-1] == f"history hash: {history_hash}"
    return str(history_hash)


@pytest.mark.parametrize("link", ["shared memory", "network"])
def test_a_lockstep_colony_has_the_history_of_an_in_process_one(
    tmp_path: Path, in_process: str, link: str
) -> None:
    """`launch --lockstep` and `evolve` end with the same history hash, whether robots share memory with their bodies
    or not, and several matings are in it."""
    out = tmp_path / "launched"
    more = ["--no-shared-memory"] if link == "network" else []
    with colony(tmp_path) as made:
        options = ("-n", "4", "--lockstep", *OPTIONS, *more, "--out", str(out))
        launched = made.start("launch", "launch", *options)
        assert history_hash(launched, out) == in_process
    matings = launched.output.partition(" matings led to")[0].split()[-1]
    assert int(matings) >= 5, "with so few matings this shows nothing"
