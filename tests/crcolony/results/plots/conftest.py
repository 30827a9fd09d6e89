"""A comparison of two conditions, and its figures."""

import shutil
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from crcolony.results.plots.conditions import read_conditions
from crcolony.results.plots.figures import draw_figures
from crcolony.results.plots.style import style
from tests.support.plotted_runs import run_comparison


@pytest.fixture(scope="session")
def comparison(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return three seeds of two conditions, in folders as of `evolve --seeds 3 --compare`."""
    return run_comparison(tmp_path_factory.mktemp("comparison"))


@pytest.fixture
def copy(comparison: Path, tmp_path: Path) -> Path:
    """Return a copy of the comparison that a test may damage."""
    return Path(shutil.copytree(comparison, tmp_path / "copy"))


@pytest.fixture(scope="session")
def figures(comparison: Path) -> dict[str, Figure]:
    """Return the figures of the comparison by name."""
    with style():
        return draw_figures(read_conditions([comparison]))
