"""`crcolony plot`: draw figures."""

import subprocess
from pathlib import Path

import pytest

from crcolony.cli import main
from tests.support.command_line import ENVIRONMENT, Refused, command
from tests.support.plotted_runs import run_comparison


@pytest.fixture(scope="module")
def comparison(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return three seeds of two conditions."""
    return run_comparison(tmp_path_factory.mktemp("comparison"))


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("plot", "the following arguments are required: FOLDER"),
        ("plot missing", "missing: there is no such folder"),
        (
            "plot .",
            ".: neither a run (config.toml) nor a comparison (CONDITION/seed-N/config.toml)",
        ),
        ("plot one other", "several folders: --out is needed, the folder for the figures"),
        ("plot . --format pdf,tiff", "--format pdf,tiff: 'tiff' is not one of pdf, svg, png"),
    ],
)
def test_wrong_options_are_refused_in_one_line(words: str, line: str, refused: Refused) -> None:
    """The line names the option or file, and the reason."""
    assert line in refused(words)


def test_figures_are_written_as_vectors_and_pictures(
    comparison: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The command prints what it draws, and then the files."""
    assert main(["plot", str(comparison)]) == 0
    names = ("matings", "runs", "generations", "meta_parameters", "potentials")
    files = [
        str(comparison / "plots" / f"{name}.{kind}") for name in names for kind in ("pdf", "png")
    ]
    assert capsys.readouterr().out.splitlines() == [
        "implicit (3 runs): generations 0 to 2",
        "central (3 runs): generations 0 to 2",
        *files,
    ]
    assert sorted(map(str, (comparison / "plots").iterdir())) == sorted(files)


def test_folder_and_formats_can_be_chosen(comparison: Path, tmp_path: Path) -> None:
    """With --out and --format."""
    folder = comparison / "implicit" / "seed-1"
    words = ["plot", folder, "--out", tmp_path / "a" / "b", "--format", "svg, pdf"]
    assert main(list(map(str, words))) == 0
    assert {path.suffix for path in (tmp_path / "a" / "b").iterdir()} == {".svg", ".pdf"}


def test_a_home_that_cannot_be_written_is_no_matter(comparison: Path, tmp_path: Path) -> None:
    """matplotlib has no place for its cache there, and nothing is said of it."""
    (tmp_path / "home").touch()
    done = subprocess.run(
        command("plot", comparison, "--out", tmp_path / "plots", "--format", "svg"),
        capture_output=True,
        text=True,
        timeout=200,
        env={**ENVIRONMENT, "HOME": str(tmp_path / "home"), "XDG_CONFIG_HOME": ""},
    )
    assert (done.returncode, done.stderr) == (0, "")
