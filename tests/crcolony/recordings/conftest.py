"""One short run for all tests of recordings."""

from pathlib import Path

import pytest

from crcolony.recordings.past_run import read_run
from crcolony.recordings.resimulation import Windows, resimulate
from crcolony.telemetry.samples import TelemetrySample
from tests.support.run_folders import run
from tests.support.runs import SEED
from tests.support.small_colony import small


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results folder of a run of three generations."""
    folder = tmp_path_factory.mktemp("runs") / "run"
    run(folder, small(f"seed={SEED}"))
    return folder


@pytest.fixture(scope="session")
def samples(folder: Path) -> list[TelemetrySample]:
    """That run, re-simulated."""
    return list(resimulate(read_run(folder)))


@pytest.fixture(scope="session")
def short_samples(folder: Path) -> list[TelemetrySample]:
    """The same with 200 scenes."""
    return list(resimulate(read_run(folder), Windows(frozenset({0, 2}), 20.0)))
