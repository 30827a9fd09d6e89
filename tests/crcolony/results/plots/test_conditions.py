"""Runs are grouped by their settings; what cannot be drawn is refused in one line that names the file."""

from collections.abc import Sequence
from pathlib import Path

import pytest

from crcolony.results.plots import draw_plots
from crcolony.results.plots.conditions import Condition, PlotError, read_conditions
from tests.support.plotted_runs import cut, run_to_end
from tests.support.small_colony import small


def named(conditions: Sequence[Condition]) -> dict[str, list[str]]:
    """Return the folders of each condition's runs by its name."""
    return {condition.name: [one.folder.name for one in condition.runs] for condition in conditions}


def test_runs_that_differ_only_in_seed_are_one_condition(comparison: Path) -> None:
    """It needs no name."""
    folders = [comparison / "implicit" / f"seed-{seed}" for seed in (2, 1)]
    assert named(read_conditions(folders)) == {"": ["seed-2", "seed-1"]}


def test_other_conditions_are_named_by_what_differs(comparison: Path) -> None:
    """In the order in which they are given."""
    folders = [comparison / condition / "seed-1" for condition in ("central", "implicit")]
    assert named(read_conditions(folders)) == {
        "selection = central": ["seed-1"],
        "selection = implicit": ["seed-1"],
    }


def test_conditions_that_differ_in_several_settings_are_named_by_what_is_not_default(
    comparison: Path, tmp_path: Path
) -> None:
    """The one that has the defaults is the baseline."""
    conditions = [comparison / condition / "seed-1" for condition in ("implicit", "central")]
    larger = run_to_end(tmp_path / "larger", small("robots=5", "selection=central"))
    assert [condition.name for condition in read_conditions([*conditions, larger])] == [
        "baseline",
        "selection = central",
        "robots = 5, selection = central",
    ]


def test_the_number_of_generations_makes_no_condition(tmp_path: Path) -> None:
    """Only the generations that have ended count."""
    folders = [
        run_to_end(tmp_path / "1", small("seed=1")),
        run_to_end(tmp_path / "2", small("seed=2", "generations=2")),
    ]
    (condition,) = read_conditions(folders)
    assert condition.describe() == "2 runs: generations 0 to 1; fewer than 2 runs reach 2"


def test_conditions_that_differ_in_much_are_named_by_their_folders(tmp_path: Path) -> None:
    """A legend has no room for it."""
    other = small("robots=3", "learning.shaping=false", "life.slices=1", "arena.packs=5")
    folders = [run_to_end(tmp_path / "one", small()), run_to_end(tmp_path / "other", other)]
    assert [condition.name for condition in read_conditions(folders)] == [
        str(folder) for folder in folders
    ]


def test_comparisons_of_other_settings_are_not_mixed_up(copy: Path) -> None:
    """Where two conditions have a folder of the same name, settings distinguish them."""
    run_to_end(copy / "more" / "implicit" / "seed-1", small("robots=3"))
    names = {condition.name for condition in read_conditions([copy, copy / "more"])}
    assert names == {"baseline", "selection = central", "robots = 3"}


def test_no_run_counts_twice(comparison: Path, copy: Path) -> None:
    """Given twice, or as a copy: the band would be too narrow."""
    folder = comparison / "implicit" / "seed-1"
    for same in (folder, copy / "implicit" / "seed-1"):
        with pytest.raises(PlotError, match=f"{same}: the same run as {folder}"):
            read_conditions([folder, same])


def test_runs_that_stopped_early_are_counted_as_far_as_they_go(copy: Path) -> None:
    """A fourth run that ended sooner is reported as missing later; of three, none may be missing."""
    run_to_end(copy / "implicit" / "seed-4", small("seed=4"))
    cut(copy / "implicit" / "seed-4", 1)
    cut(copy / "central" / "seed-2", 2)
    implicit, central = read_conditions([copy])
    assert implicit.describe() == "implicit (3 to 4 runs): generations 0 to 2"
    assert central.describe() == ("central (3 runs): generations 0 to 1; fewer than 3 runs reach 2")


def test_a_run_of_a_comparison_that_has_just_begun_does_not_count(copy: Path) -> None:
    """The others can be drawn already."""
    (copy / "central" / "seed-3" / "generations.csv").unlink()
    assert [condition.label for condition in read_conditions([copy])] == [
        "implicit (3 runs)",
        "central (2 runs)",
    ]


def test_folders_without_a_run_are_refused(tmp_path: Path) -> None:
    """A folder that does not exist, a file, and an empty folder."""
    (tmp_path / "file").touch()
    (tmp_path / "empty").mkdir()
    for name, why in (
        ("nowhere", "there is no such folder"),
        ("file", "there is no such folder"),
        ("empty", "neither a run"),
    ):
        with pytest.raises(PlotError, match=f"{tmp_path / name}: {why}"):
            draw_plots(tmp_path / name)


def test_runs_without_a_generation_are_refused(copy: Path) -> None:
    """No generation of a run has ended, or of any run of a comparison."""
    for table_ in copy.glob("*/*/generations.csv"):
        table_.unlink()
    with pytest.raises(PlotError, match=f"{copy}: no generation has ended"):
        read_conditions([copy])
    folder = copy / "implicit" / "seed-1"
    (folder / "generations.csv").touch()
    with pytest.raises(PlotError, match=r"seed-1/generations\.csv: no generation has ended"):
        read_conditions([folder])


def test_damaged_tables_are_refused(copy: Path) -> None:
    """No numbers, a missing column, a last row that is cut short, generations out of order."""
    path = copy / "implicit" / "seed-1" / "generations.csv"
    whole = path.read_text()
    header, first, second, *_ = whole.splitlines(keepends=True)
    for text, why in (
        (whole.replace("0.", "many", 1), "a row is not made of numbers"),
        (whole.replace("conceptions", "children"), "no column conceptions"),
        (whole[:-40], "a row is not as long as the header"),
        (whole[:-3], "the last row is half-written"),
        (header + first.strip() + ",7\r\n", "a row is not as long as the header"),
        (header + second + first, "generations are not in order"),
        (header + first.replace(first.split(",")[2], "nan", 1), "a number is not finite"),
    ):
        path.write_text(text)
        with pytest.raises(PlotError, match=rf"seed-1/generations\.csv: corrupt: {why}"):
            read_conditions([copy])
