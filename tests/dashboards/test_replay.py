"""A run that is over is seen again in the same dashboard, whatever its folder holds."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
import pytest
from crcolony_dashboards.replay import REPLAY_FILE, run_replay
from rerun.chunk import RrdReader

from crcolony.protocol.identity import seeded
from crcolony.recordings.past_run import PastRunError, read_run
from crcolony.recordings.resimulation import HistoryDiffersError, Windows, resimulate
from crcolony.recordings.telemetry_file import TELEMETRY_FILE, TelemetryError, TelemetryFile
from crcolony.results.generation_table import read_table
from crcolony.world.arena import Arena
from tests.support.runs import run
from tests.support.small_colony import small

WINDOWS = Windows(length_s=5.0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of three generations."""
    folder = tmp_path_factory.mktemp("runs") / "run"
    run(folder, small("seed=10"))
    return folder


@pytest.fixture(scope="module")
def rrd(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Its dashboard."""
    path = tmp_path_factory.mktemp("films") / "film.rrd"
    run_replay(folder, path, WINDOWS)
    return path


def moving(rrd: Path, entity: str) -> list[dict[str, Any]]:
    """Return what a film holds of an entity, moment by moment of the colony's time."""
    found: list[dict[str, Any]] = []
    for chunk in RrdReader(rrd).stream():
        batch = chunk.to_record_batch()
        if chunk.entity_path == entity and "sim" in batch.schema.names:
            names = [name for name in batch.schema.names if ":" in name or name == "generation"]
            times = batch.column("sim").cast(pa.int64()).to_pylist()
            rows = batch.select(names).to_pylist()
            found += [{"sim": at, **row} for at, row in zip(times, rows, strict=True)]
    return sorted(found, key=lambda row: int(row["sim"]))


def places(rrd: Path) -> list[dict[str, Any]]:
    """Return where a film shows robots, as long as it shows any."""
    return [row for row in moving(rrd, "/arena/world/robots") if row["Points2D:positions"]]


def test_robots_are_shown_from_where_they_began(folder: Path, rrd: Path) -> None:
    """The first picture has them near the places at which the run's arena put them; they move on from there."""
    config = small("seed=10")
    arena = Arena(config.robots, config.arena, config.body, config.seed)
    shown = places(rrd)
    first = np.array(shown[0]["Points2D:positions"])
    farthest_m = 2 * max(config.learning.speeds_m_s) * config.arena.control_period_s + 0.12
    assert np.abs(first - arena.world.poses[:, :2]).max() < farthest_m
    last = np.array(shown[-1]["Points2D:positions"])
    assert np.abs(last - first).max() > 0.05


def test_every_generation_is_in_it_with_the_figures_of_its_table(folder: Path, rrd: Path) -> None:
    """Mean matings, at the generation that they are of."""
    table = {int(row["generation"]): row for row in read_table(folder / "generations.csv")}
    drawn = {
        row["generation"]: row["Measurements:values"][0]
        for row in moving(rrd, "/evolution/matings/colony")
    }
    assert drawn.keys() == table.keys()
    for generation, mean in drawn.items():
        assert mean == pytest.approx(float(table[generation]["matings"]))


def test_a_family_and_what_happened_are_in_it(rrd: Path) -> None:
    """All tabs have something to show."""
    assert moving(rrd, "/lineage/family")
    lines = [row["TextLog:text"][0] for row in moving(rrd, "/log/mating")]
    assert any("mated with" in line for line in lines)
    for entity in ("/life/energy/robot_0", "/network/robots", "/evolution/agent", "/arena/now"):
        assert moving(rrd, entity), entity


def test_what_was_recorded_is_seen_as_it_would_have_been(
    folder: Path, rrd: Path, tmp_path: Path
) -> None:
    """A telemetry file of the same colony shows the same robots at the same moments of its time."""
    recording = TelemetryFile.open(tmp_path / "watched" / TELEMETRY_FILE)
    for sample in resimulate(read_run(folder), WINDOWS):
        recording.add(sample)
    assert recording.close() is None
    run_replay(tmp_path / "watched", None, WINDOWS)
    again = tmp_path / "watched" / REPLAY_FILE
    lived, seen = (
        {row["sim"]: row["Points2D:positions"] for row in places(of)} for of in (rrd, again)
    )
    both = lived.keys() & seen.keys()
    assert len(both) > 2 * 20
    assert all(lived[when] == seen[when] for when in both)
    figures = [moving(of, "/evolution/matings/colony") for of in (rrd, again)]
    assert figures[0] == figures[1]


def test_of_a_run_in_real_time_that_nobody_watched_its_history_is_shown(
    folder: Path, tmp_path: Path
) -> None:
    """Generations and family; nobody knows where its robots were."""
    copy = tmp_path / "launched"
    shutil.copytree(folder, copy)
    message = json.loads((copy / "run.json").read_text())
    robots = [seeded("others", 10, number).id.hex() for number in range(4)]
    (copy / "run.json").write_text(json.dumps({**message, "robots": robots}))
    run_replay(copy, None, WINDOWS)
    rrd = copy / REPLAY_FILE
    assert len(moving(rrd, "/evolution/matings/colony")) == 3
    assert moving(rrd, "/lineage/family")
    assert not places(rrd)


def test_a_run_that_comes_out_otherwise_is_filmed_and_said(folder: Path, tmp_path: Path) -> None:
    """The film shows the run as it is with this version of the code."""
    copy = tmp_path / "other"
    shutil.copytree(folder, copy)
    message = json.loads((copy / "run.json").read_text())
    (copy / "run.json").write_text(json.dumps({**message, "history_hash": "00" * 16}))
    with pytest.raises(HistoryDiffersError, match="lived again"):
        run_replay(copy, None, WINDOWS)
    assert moving(copy / REPLAY_FILE, "/evolution/matings/colony")


def test_what_cannot_be_heard_leaves_no_film(tmp_path: Path) -> None:
    """Neither a folder that is none, nor a file of another kind."""
    other = tmp_path / "notes.txt"
    other.write_text("no telemetry")
    with pytest.raises(TelemetryError, match=r"notes\.txt"):
        run_replay(other, None, WINDOWS)
    with pytest.raises(PastRunError, match="missing"):
        run_replay(tmp_path, None, WINDOWS)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]
