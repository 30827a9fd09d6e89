"""A results folder is read as the run that it describes, or refused with the file and the reason."""

import json
import shutil
from pathlib import Path

import pytest

from crcolony.config import ConfigError
from crcolony.protocol.identity import seeded
from crcolony.recordings.past_run import PastRunError, read_history, read_run
from crcolony.recordings.resimulation import from_history
from tests.support.runs import SEED


def test_a_run_has_the_robots_of_its_config(folder: Path) -> None:
    """Their ids follow from colony, seed and number, as in a lockstep colony."""
    run = read_run(folder)
    assert run.colony == "colony"
    assert list(run.robots) == [seeded("colony", SEED, number).id for number in range(4)]
    assert run.is_repeatable
    assert (run.generations, run.config.seed) == (3, SEED)


def test_a_run_with_robots_of_its_own_cannot_be_repeated(folder: Path, tmp_path: Path) -> None:
    """As a launch in real time leaves it: their ids are in run.json."""
    copy = tmp_path / "launched"
    shutil.copytree(folder, copy)
    description = json.loads((copy / "run.json").read_text())
    robots = [bytes([number] * 16) for number in range(4)]
    names = [robot.hex() for robot in robots]
    (copy / "run.json").write_text(json.dumps({**description, "robots": names}))
    run = read_run(copy)
    assert list(run.robots) == robots
    assert not run.is_repeatable


def test_a_history_is_in_order(folder: Path) -> None:
    """Of ticks."""
    ticks = [event.tick for event in read_history(read_run(folder).history)]
    assert ticks == sorted(ticks)
    assert len(ticks) > 4 * 4 * 4


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("config.toml", None, "config.toml is missing"),
        ("config.toml", "robots = 'many'", "robots"),
        ("run.json", None, "run.json: missing"),
        ("run.json", "{}", "run.json: not a description of a run"),
        ("run.json", "[1]", "run.json: not a description of a run"),
        ("run.json", "\x00", "run.json: not a description of a run"),
        ("run.json", '{"generations": 1, "history_hash": "", "robots": ["ab"]}', "run.json"),
        ("history.sqlite", None, "history.sqlite: missing"),
        ("history.sqlite", "nonsense " * 100, "history.sqlite: cannot be read"),
    ],
)
def test_a_folder_that_describes_no_run_is_named(
    tmp_path: Path, folder: Path, name: str, content: str | None, reason: str
) -> None:
    """With the file and the reason, in one line."""
    copy = tmp_path / "run"
    shutil.copytree(folder, copy)
    (copy / name).unlink()
    if content is not None:
        (copy / name).write_text(content)
    with pytest.raises((PastRunError, ConfigError), match=reason) as refused:
        list(from_history(read_run(copy)))
    assert str(copy) in str(refused.value)
    assert "\n" not in str(refused.value)
