"""A results folder says what is in it, robot by robot."""

from pathlib import Path

import pytest

from crcolony.config import to_toml
from crcolony.results.inspect_folder import inspect_folder
from crcolony.storage.files import FolderError
from tests.support.run_folders import rows_of, run
from tests.support.small_colony import live, new_colony, small
from tests.support.stored_colony import id_of, write_robots


def test_a_run_in_one_process_is_shown_by_its_history(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """How far it is, births, matings and deaths of every robot, and the other files."""
    folder = tmp_path / "L[/home]x"
    results = run(folder, small())
    inspect_folder(folder)
    first, heads, *rows = capsys.readouterr().out.splitlines()
    assert first.startswith(f"{folder}: a run in one process, 4 robots, implicit selection, seed 1")
    assert f"done in generation 3 of 3; history hash: {results.hash}" in first
    assert heads.split()[:3] == ["robot", "generation", "born"]
    assert [row.split()[:3] for row in rows[:4]] == [[str(n), "3", "16"] for n in range(4)]
    matings = sum(int(row.split()[3]) for row in rows[:4])
    assert matings == 2 * len(rows_of(folder, "matings")) > 0
    assert f"{folder / 'history.sqlite'}: the history of the run" in rows


def test_a_colony_of_processes_is_shown_by_the_robots_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each with its id; one that is damaged says so, and the others are shown all the same."""
    colony, recorder = new_colony()
    colony.start()
    live(colony, 1)
    (tmp_path / "config.toml").write_text(to_toml(colony.config))
    paths = write_robots(tmp_path, recorder.events, 4)
    paths[2].write_bytes(b"damaged" * 999)
    inspect_folder(tmp_path)
    first, _, *rows = capsys.readouterr().out.splitlines()
    assert ": a colony of processes, 4 robots" in first
    shown = [row for row in rows if row.split()[:1] in (["0"], ["1"], ["3"])]
    assert [row.split()[1] for row in shown] == [id_of(n).hex()[:8] for n in (0, 1, 3)]
    assert f"{paths[2]}: not a crcolony robot file" in rows
    assert rows[-1] == f"{paths[0]}: a robot's file (crcolony inspect)"


def test_a_comparison_lists_its_runs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With how far each is."""
    for seed in (1, 2):
        run(tmp_path / "implicit" / f"seed-{seed}", small("generations=1", f"seed={seed}"))
    inspect_folder(tmp_path)
    first, *runs = capsys.readouterr().out.splitlines()
    assert first == f"{tmp_path}: a comparison of 2 runs"
    assert all("done in generation 1 of 1" in line for line in runs)
    assert len(runs) == 2


def test_any_other_folder_is_refused(tmp_path: Path) -> None:
    """By name."""
    with pytest.raises(FolderError, match=f"{tmp_path}: neither a results folder"):
        inspect_folder(tmp_path)
