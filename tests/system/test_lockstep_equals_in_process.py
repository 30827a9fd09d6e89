"""Distribution changes nothing: processes over Zenoh and a single process have the same history."""

import json
from pathlib import Path

from tests.support.process_colony import colony, settings


def test_a_lockstep_colony_has_the_history_of_an_in_process_one(tmp_path: Path) -> None:
    """`launch --lockstep` and `evolve` end with the same history hash, and several matings are in it."""
    options = [*settings("generations=2"), "--seed", "3", "--no-plots"]
    with colony(tmp_path) as made:
        launched = made.start(
            "launch",
            "launch",
            "-n",
            "4",
            "--lockstep",
            *options,
            "--out",
            str(tmp_path / "launched"),
        )
        assert launched.wait(120.0) == 0, launched.output
        evolved = made.start(
            "evolve", "evolve", "--robots", "4", *options, "--out", str(tmp_path / "evolved")
        )
        assert evolved.wait(120.0) == 0, evolved.output
    hashes = [
        json.loads((tmp_path / run / "run.json").read_text())["history_hash"]
        for run in ("launched", "evolved")
    ]
    for process, history_hash in zip((launched, evolved), hashes, strict=True):
        assert process.output.splitlines()[-1] == f"history hash: {history_hash}"
    assert hashes[0] == hashes[1]
    matings = launched.output.partition(" matings led to")[0].split()[-1]
    assert int(matings) >= 5, "with so few matings this shows nothing"
