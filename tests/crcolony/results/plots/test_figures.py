"""Plots are drawn from results folders alone, of a run or of many; what cannot be drawn is said in a line."""

import shutil
import sqlite3
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import FillBetweenPolyCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.image import imread

from crcolony.cli import main
from crcolony.config import Config
from crcolony.in_process.run import run_until_done, start_run
from crcolony.results.generation_table import read_table
from crcolony.results.plots import draw_plots
from crcolony.results.plots.bands import band_of
from crcolony.results.plots.conditions import Condition, PlotError, read_conditions
from crcolony.results.plots.figures import (
    draw_figures,
    draw_generations,
    draw_matings,
    draw_meta_parameters,
)
from crcolony.results.plots.potentials import draw_potentials
from crcolony.results.plots.style import COLUMN_IN, LINES, PAGE_IN, style, write_figure
from crcolony.robot.genes import META_PARAMETERS
from tests.support.small_colony import small

T_OF_3, T_OF_4 = 4.30265, 3.18245
"""Student's t for 95 %, two-sided, of 3 and of 4 values, from a printed table."""


def run(folder: Path, config: Config) -> Path:
    results, colony = start_run(folder, config)
    run_until_done(results, colony, lambda: False, lambda _: None)
    results.close()
    return folder


def table(*values: float, first: int = 0) -> dict[str, np.ndarray]:
    """A run whose quantity had these values."""
    generation = np.arange(first, first + len(values), dtype=float)
    return {"generation": generation, "x": np.array(values)}


@pytest.fixture(scope="module")
def comparison(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three seeds of two arms, laid out as `run_until_done --seeds 3 --compare` does."""
    out = tmp_path_factory.mktemp("comparison")
    for seed in (1, 2, 3):
        run(out / "implicit" / f"seed-{seed}", small(f"seed={seed}"))
        run(out / "central" / f"seed-{seed}", small(f"seed={seed}", "selection=central"))
    return out


@pytest.fixture
def copy(comparison: Path, tmp_path: Path) -> Path:
    """The same, to be damaged."""
    return Path(shutil.copytree(comparison, tmp_path / "copy"))


def cut(folder: Path, generations: int) -> None:
    """Make a run end early."""
    path = folder / "generations.csv"
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[: generations + 1]))


def drawn(
    folders: Sequence[Path], draw: Callable[[Sequence[Condition]], Figure] = draw_generations
) -> Figure:
    with style():
        return draw(read_conditions(folders))


@pytest.fixture(scope="module")
def figures(comparison: Path) -> dict[str, Figure]:
    """Those of the comparison."""
    with style():
        return draw_figures(read_conditions([comparison]))


def heights(axes: Axes) -> list[float]:
    """What the first line shows."""
    return [float(y) for y in np.asarray(axes.lines[0].get_ydata())]


def picture(figure: Figure) -> np.ndarray:
    """What the first image shows."""
    return np.asarray(figure.axes[0].images[0].get_array())


def bands_in(axes: Axes) -> list[FillBetweenPolyCollection]:
    return [part for part in axes.collections if isinstance(part, FillBetweenPolyCollection)]


def said_in(figure: Figure) -> list[str]:
    """What the legend says, its title first."""
    (legend,) = figure.legends
    return [legend.get_title().get_text(), *(text.get_text() for text in legend.get_texts())]


class TestBand:
    """Mean, band and number of runs by generation, compared with values found by hand."""

    def test_three_runs_have_the_interval_of_student(self) -> None:
        """1, 2 and 6 have the mean 3 and the variance 7."""
        band = band_of([table(1.0, 5.0), table(2.0, 5.0), table(6.0, 5.0)], "x")
        half = T_OF_3 * np.sqrt(7.0 / 3.0)
        assert band.generation.tolist() == [0.0, 1.0]
        assert band.mean == pytest.approx([3.0, 5.0])
        assert band.low == pytest.approx([3.0 - half, 5.0], rel=1e-5)
        assert band.high == pytest.approx([3.0 + half, 5.0], rel=1e-5)
        assert band.count.tolist() == [3, 3]

    def test_of_two_runs_the_band_goes_from_one_to_the_other(self) -> None:
        """Whichever is above, as far as both go."""
        band = band_of([table(1.0, 8.0, 3.0), table(2.0, 4.0)], "x")
        assert band.mean.tolist() == [1.5, 6.0]
        assert (band.low.tolist(), band.high.tolist()) == ([1.0, 4.0], [2.0, 8.0])
        assert band.count.tolist() == [2, 2]

    def test_one_run_is_its_own_band(self) -> None:
        """There is nothing to say on how sure it is."""
        band = band_of([table(1.0, 8.0)], "x")
        assert band.low.tolist() == band.mean.tolist() == band.high.tolist() == [1.0, 8.0]
        assert band.count.tolist() == [1, 1]

    def test_runs_of_unequal_length_are_drawn_as_far_as_three_go(self) -> None:
        """The interval is that of the runs which are there."""
        tables = [table(0.0, 1.0, 9.0), table(2.0, 2.0, 9.0), table(4.0, 6.0), table(2.0)]
        band = band_of(tables, "x")
        assert band.count.tolist() == [4, 3]
        assert band.mean == pytest.approx([2.0, 3.0])
        half = [T_OF_4 * np.sqrt(8.0 / 3.0 / 4.0), T_OF_3 * np.sqrt(7.0 / 3.0)]
        assert band.high - band.mean == pytest.approx(half, rel=1e-5)

    def test_generations_are_told_by_their_number(self) -> None:
        """And not by their place in the table."""
        band = band_of([table(1.0, 2.0, 3.0), table(4.0, 5.0, first=1)], "x")
        assert band.generation.tolist() == [1.0, 2.0]
        assert band.mean.tolist() == [3.0, 4.0]


class TestOneRun:
    """A run's figures, as drawn at its end and by `crcolony plot`."""

    def test_every_plot_is_a_picture_with_something_on_it(self, tmp_path: Path) -> None:
        """Generations, meta-parameters, potentials."""
        paths = draw_plots(run(tmp_path / "run", small()))
        assert [path.name for path in paths] == [
            "generations.png",
            "meta_parameters.png",
            "potentials.png",
        ]
        for path in paths:
            pixels = imread(path)
            assert min(pixels.shape[:2]) > 300
            assert len(np.unique(pixels[..., 0])) > 50

    @pytest.mark.parametrize(
        "settings",
        [
            ("learning.shaping=false",),
            ("life.agents=1", "robots=1"),
            ("generations=1",),
            ("heredity.highest_lambda=0",),
        ],
    )
    def test_small_and_unshaped_colonies_have_plots_too(
        self, tmp_path: Path, settings: tuple[str, ...]
    ) -> None:
        """With flat potentials, a single agent or generation to show, or a meta-parameter that is always 0."""
        assert len(draw_plots(run(tmp_path / "run", small(*settings)))) == 3

    def test_it_has_lines_without_bands_and_the_spread_over_its_agents(
        self, comparison: Path
    ) -> None:
        """Matings are as in the table; of a meta-parameter half and nine tenths of the agents are shown."""
        folder = comparison / "implicit" / "seed-2"
        generations, meta = drawn([folder]), drawn([folder], draw_meta_parameters)
        rows = read_table(folder / "generations.csv")
        assert heights(generations.axes[0]) == [float(row["matings"]) for row in rows]
        assert not bands_in(generations.axes[0])
        assert [len(bands_in(axes)) for axes in meta.axes] == 10 * [2]
        assert said_in(generations) == ["", "1 run, seed 2"]
        assert "the middle 50 % and 90 %" in said_in(meta)[0]

    def test_drawing_leaves_the_history_alone(self, copy: Path) -> None:
        """It only reads."""
        folder = copy / "implicit" / "seed-1"
        before = (folder / "history.sqlite").read_bytes()
        drawn([folder], draw_potentials)
        assert (folder / "history.sqlite").read_bytes() == before
        database = sqlite3.connect(folder / "history.sqlite")
        assert database.execute("PRAGMA integrity_check").fetchone()


class TestManyRuns:
    """A line and a band for each arm, and words that say what they are."""

    def test_a_comparison_has_all_arms_in_every_axes(self, figures: dict[str, Figure]) -> None:
        """Each figure by generation has a line and a band for both, and says so; axes say what they show."""
        assert list(figures) == ["matings", "generations", "meta_parameters", "potentials"]
        for figure in [figures[name] for name in figures if name != "potentials"]:
            for axes in figure.axes:
                assert (len(axes.lines), len(bands_in(axes))) == (2, 2)
            title, *labels = said_in(figure)
            assert "Means over runs with 95 % intervals (Student's t)" in title
            assert labels == ["implicit (3 runs)", "central (3 runs)"]
        titles = [axes.get_title(loc="left") for axes in figures["generations"].axes]
        assert titles == [
            "Matings per agent",
            "Conceptions per agent",
            "Batteries captured per agent",
            "Mean energy while alive",
            "Share of agents that starved",
            "Steps lived per agent",
        ]
        meta = figures["meta_parameters"].axes
        assert [axes.get_title(loc="left") for axes in meta[:5]] == [
            "α",
            "γ",
            "λ",
            "τ",
            "decay of τ",
        ]
        assert [meta[0].get_ylabel(), meta[5].get_ylabel()] == ["foraging", "mating"]

    def test_what_is_drawn_is_the_mean_and_the_interval_of_the_tables(
        self, comparison: Path, figures: dict[str, Figure]
    ) -> None:
        """For the matings, and for the medians of every meta-parameter of a module."""
        shown = {"matings": figures["matings"].axes[0]}
        for meta, axes in zip(META_PARAMETERS, figures["meta_parameters"].axes, strict=False):
            shown[f"foraging.{meta} q50"] = axes
        for column, axes in shown.items():
            values = np.array(
                [
                    [float(row[column]) for row in read_table(folder / "generations.csv")]
                    for folder in sorted((comparison / "implicit").iterdir())
                ]
            )
            mean = values.mean(axis=0)
            high = mean + T_OF_3 * values.std(axis=0, ddof=1) / np.sqrt(3.0)
            assert heights(axes) == pytest.approx(mean)
            corners = np.asarray(bands_in(axes)[0].get_paths()[0].vertices)
            assert max(corners[:, 1]) == pytest.approx(high.max(), rel=1e-5)

    def test_potentials_are_the_mean_over_agents_and_runs(self, tmp_path: Path) -> None:
        """With one agent a run, the image of three runs is the mean of their three images."""
        settings = ("life.agents=1", "robots=1")
        folders = [
            run(tmp_path / str(seed), small(*settings, f"seed={seed}")) for seed in (1, 2, 3)
        ]
        alone = [picture(drawn([folder], draw_potentials)) for folder in folders]
        assert np.allclose(picture(drawn(folders, draw_potentials)), np.mean(alone, axis=0))

    def test_arms_without_shaping_have_no_potentials_to_show(
        self, comparison: Path, tmp_path: Path
    ) -> None:
        """They would be flat."""
        flat = run(tmp_path / "flat", small("learning.shaping=false"))
        figure = drawn([comparison / "implicit" / "seed-1", flat], draw_potentials)
        titles = [axes.get_title(loc="left") for axes in figure.axes]
        assert [title for title in titles if title] == ["learning.shaping = true (1 run, seed 1)"]

    def test_a_potential_may_be_flat_beside_another(self, comparison: Path, tmp_path: Path) -> None:
        """It has the same colours, and no line of equal height."""
        settings = ("heredity.potential_sd=1e-6", "heredity.potential_mutation_sd=0.0")
        flat = run(tmp_path / "flat", small(*settings))
        figure = drawn([comparison / "implicit" / "seed-1", flat], draw_potentials)
        shaped, _, below, *_ = figure.axes
        assert shaped.images[0].get_clim() == below.images[0].get_clim()
        assert (len(shaped.collections), len(below.collections)) == (1, 0)

    @pytest.mark.parametrize(
        ("sizes", "said"),
        [
            ((1, 1), ""),
            ((2, 1), "Means over runs; bands go from one run to the other"),
            ((2, 3), "of two runs the bands go from one to the other"),
            ((3, 1), "Means over runs with 95 % intervals (Student's t)"),
        ],
    )
    def test_the_legend_says_what_the_bands_are(
        self, comparison: Path, sizes: Sequence[int], said: str
    ) -> None:
        """And how many runs there are; a single one has no band."""
        folders = [
            comparison / condition / f"seed-{seed}"
            for condition, size in zip(("implicit", "central"), sizes, strict=True)
            for seed in range(1, size + 1)
        ]
        figure = drawn(folders, draw_matings)
        assert len(bands_in(figure.axes[0])) == sum(size > 1 for size in sizes)
        title, *labels = said_in(figure)
        assert said in title
        counts = [f"({size} runs)" if size > 1 else "(1 run, seed 1)" for size in sizes]
        assert [label.partition(" (")[2] for label in labels] == [c[1:] for c in counts]

    def test_runs_that_stopped_early_are_counted_as_far_as_they_go(self, copy: Path) -> None:
        """A fourth run that ended sooner is said to be missing later; of three, none may be."""
        run(copy / "implicit" / "seed-4", small("seed=4"))
        cut(copy / "implicit" / "seed-4", 1)
        cut(copy / "central" / "seed-2", 2)
        implicit, central = read_conditions([copy])
        assert implicit.describe() == "implicit (3 to 4 runs): generations 0 to 2"
        assert central.describe() == (
            "central (3 runs): generations 0 to 1; fewer than 3 runs go on to 2"
        )

    def test_a_run_of_a_comparison_that_has_just_begun_does_not_count(self, copy: Path) -> None:
        """While the others can be drawn already."""
        (copy / "central" / "seed-3" / "generations.csv").unlink()
        assert [condition.label for condition in read_conditions([copy])] == [
            "implicit (3 runs)",
            "central (2 runs)",
        ]


class TestArms:
    """Which runs belong together, and what they are called."""

    @staticmethod
    def named(conditions: Sequence[Condition]) -> dict[str, list[str]]:
        return {
            condition.name: [one.folder.name for one in condition.runs] for condition in conditions
        }

    def test_runs_that_differ_only_in_seed_are_one_arm(self, comparison: Path) -> None:
        """It needs no name."""
        folders = [comparison / "implicit" / f"seed-{seed}" for seed in (2, 1)]
        assert self.named(read_conditions(folders)) == {"": ["seed-2", "seed-1"]}

    def test_other_arms_are_named_by_what_differs(self, comparison: Path) -> None:
        """In the order in which they are given."""
        folders = [comparison / condition / "seed-1" for condition in ("central", "implicit")]
        assert self.named(read_conditions(folders)) == {
            "selection = central": ["seed-1"],
            "selection = implicit": ["seed-1"],
        }

    def test_arms_that_differ_in_several_settings_are_named_by_what_is_not_the_default(
        self, comparison: Path, tmp_path: Path
    ) -> None:
        """And the one that has the defaults is what the others are compared with."""
        conditions = [comparison / condition / "seed-1" for condition in ("implicit", "central")]
        larger = run(tmp_path / "larger", small("robots=5", "selection=central"))
        assert [condition.name for condition in read_conditions([*conditions, larger])] == [
            "baseline",
            "selection = central",
            "robots = 5, selection = central",
        ]

    def test_how_many_generations_were_asked_for_makes_no_arm(self, tmp_path: Path) -> None:
        """Only how many there are counts."""
        folders = [
            run(tmp_path / "1", small("seed=1")),
            run(tmp_path / "2", small("seed=2", "generations=2")),
        ]
        (condition,) = read_conditions(folders)
        assert condition.describe() == "2 runs: generations 0 to 1; fewer than 2 runs go on to 2"

    def test_arms_that_differ_in_much_are_named_by_their_folders(self, tmp_path: Path) -> None:
        """A legend has no room for it."""
        other = small("robots=3", "learning.shaping=false", "life.slices=1", "arena.packs=5")
        folders = [run(tmp_path / "one", small()), run(tmp_path / "other", other)]
        assert [condition.name for condition in read_conditions(folders)] == [
            str(folder) for folder in folders
        ]

    def test_comparisons_of_other_settings_are_not_mixed_up(self, copy: Path) -> None:
        """Where two arms have a folder of the same name, settings tell them apart."""
        run(copy / "more" / "implicit" / "seed-1", small("robots=3"))
        names = {condition.name for condition in read_conditions([copy, copy / "more"])}
        assert names == {"baseline", "selection = central", "robots = 3"}

    def test_no_run_counts_twice(self, comparison: Path, copy: Path) -> None:
        """Given twice, or as a copy: the band would look surer than it is."""
        folder = comparison / "implicit" / "seed-1"
        for same in (folder, copy / "implicit" / "seed-1"):
            with pytest.raises(PlotError, match=f"{same}: the same run as {folder}"):
                read_conditions([folder, same])


class TestFiles:
    """What is written can go into a paper as it is."""

    def test_the_same_runs_give_the_same_bytes(self, comparison: Path, tmp_path: Path) -> None:
        """In every format, with lines and with images; none says when it was drawn."""
        with style():
            for draw in (draw_matings, draw_potentials):
                for kind in ("pdf", "svg", "png"):
                    one, other = (
                        write_figure(draw(read_conditions([comparison])), tmp_path / f"{name}.{kind}")
                        for name in ("one", "other")
                    )
                    assert one.read_bytes() == other.read_bytes()
                    assert b"Date" not in one.read_bytes()
                    assert b"dc:date" not in one.read_bytes()

    def test_fonts_are_embedded_as_truetype(
        self, figures: dict[str, Figure], tmp_path: Path
    ) -> None:
        """As publishers ask: none is a bitmap, or drawn by PostScript."""
        with style():
            content = write_figure(figures["meta_parameters"], tmp_path / "figure.pdf").read_bytes()
        assert b"/FontFile2" in content
        assert b"/Type3" not in content

    def test_figures_are_as_wide_as_a_column_or_two(self, figures: dict[str, Figure]) -> None:
        """And lines differ in colour and in dashes."""
        assert {name: figure.get_figwidth() for name, figure in figures.items()} == {
            "matings": COLUMN_IN,
            "generations": PAGE_IN,
            "meta_parameters": PAGE_IN,
            "potentials": COLUMN_IN,
        }
        assert len({to_hex(line["color"]) for line in LINES}) == len(LINES)
        assert len({str(line["linestyle"]) for line in LINES}) == len(LINES)

    def test_the_command_writes_vectors_and_pictures_into_the_folder(
        self, copy: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        """It says what it draws, and then the files."""
        assert main(["plot", str(copy)]) == 0
        names = ("matings", "generations", "meta_parameters", "potentials")
        files = [
            str(copy / "plots" / f"{name}.{kind}") for name in names for kind in ("pdf", "png")
        ]
        assert capsys.readouterr().out.splitlines() == [
            "implicit (3 runs): generations 0 to 2",
            "central (3 runs): generations 0 to 2",
            *files,
        ]
        assert sorted(map(str, (copy / "plots").iterdir())) == sorted(files)

    def test_folder_and_formats_can_be_chosen(self, comparison: Path, tmp_path: Path) -> None:
        """With --out and --format."""
        folder = comparison / "implicit" / "seed-1"
        words = ["plot", folder, "--out", tmp_path / "a" / "b", "--format", "svg, pdf"]
        assert main(list(map(str, words))) == 0
        assert {path.suffix for path in (tmp_path / "a" / "b").iterdir()} == {".svg", ".pdf"}


class TestRefusals:
    """What cannot be drawn is said in one line that names the file."""

    def test_folders_that_are_none(self, tmp_path: Path) -> None:
        """None there, a file, or nothing of ours in it."""
        (tmp_path / "file").touch()
        (tmp_path / "empty").mkdir()
        for name, why in (
            ("nowhere", "there is no such folder"),
            ("file", "there is no such folder"),
            ("empty", "neither a run"),
        ):
            with pytest.raises(PlotError, match=f"{tmp_path / name}: {why}"):
                draw_plots(tmp_path / name)

    def test_nothing_to_draw_yet(self, copy: Path) -> None:
        """No generation of a run has ended, or of any run of a comparison."""
        for table_ in copy.glob("*/*/generations.csv"):
            table_.unlink()
        with pytest.raises(PlotError, match=f"{copy}: no generation has ended"):
            read_conditions([copy])
        folder = copy / "implicit" / "seed-1"
        (folder / "generations.csv").touch()
        with pytest.raises(PlotError, match=r"seed-1/generations\.csv: no generation has ended"):
            read_conditions([folder])

    def test_damaged_tables(self, copy: Path) -> None:
        """No numbers, a column that is missing, a last row of which a part is missing, generations out of order."""
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

    def test_damaged_configs_and_histories(self, copy: Path) -> None:
        """No database, agents without genes, settings that are none."""
        folder = copy / "implicit" / "seed-1"
        history = folder / "history.sqlite"
        with sqlite3.connect(history) as database:
            database.execute("UPDATE births SET genes = x'00'")
        with pytest.raises(PlotError, match=rf"{history}: "):
            draw_plots(folder)
        history.write_bytes(b"nothing" * 1000)
        with pytest.raises(PlotError, match=rf"{history}: .*not a database"):
            draw_plots(folder)
        history.unlink()
        with pytest.raises(PlotError, match=rf"{history}: "):
            draw_plots(folder)
        (folder / "config.toml").write_text("robotts = 3")
        with pytest.raises(PlotError, match=r"config\.toml: robotts: there is no such setting"):
            draw_plots(folder)

    def test_more_arms_than_a_figure_can_tell_apart(self, comparison: Path) -> None:
        """Seven."""
        (condition, *_) = read_conditions([comparison])
        with pytest.raises(PlotError, match="7 settings: a figure can show 6"):
            draw_figures(7 * [condition])

    def test_output_that_cannot_be_written(self, copy: Path) -> None:
        """A file is in the way; nothing is left half-written."""
        folder = copy / "implicit" / "seed-1"
        (folder / "plots").touch()
        with pytest.raises(PlotError, match=r"plots/generations\.png: cannot be written"):
            draw_plots(folder)
