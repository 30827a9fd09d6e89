"""A run that has ended is drawn in the same dashboard, whatever its folder holds."""

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
from crcolony.recordings.telemetry_file import TELEMETRY_FILE
from crcolony.recordings.telemetry_schema import TelemetryError
from crcolony.results.generation_table import read_table
from crcolony.world.arena import Arena
from tests.support.raw_samples import raw_sample, record
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
    """Its replay."""
    path = tmp_path_factory.mktemp("replays") / "replay.rrd"
    run_replay(folder, path, WINDOWS)
    return path


def moving(rrd: Path, entity: str) -> list[dict[str, Any]]:
    """Return the rows of an entity in a recording, in order of the colony's time."""
    found: list[dict[str, Any]] = []
    for chunk in RrdReader(rrd).stream():
        batch = chunk.to_record_batch()
        if chunk.entity_path == entity and "sim" in batch.schema.names:
            names = [name for name in batch.schema.names if ":" in name or name == "generation"]
            times = batch.column("sim").cast(pa.int64()).to_pylist()
            rows = batch.select(names).to_pylist()
            found += [{"sim": at, **row} for at, row in zip(times, rows, strict=True)]
    return sorted(found, key=lambda row: int(row["sim"]))


def drawn_robots(rrd: Path) -> list[dict[str, Any]]:
    """Return the rows of a recording that show robots."""
    return [row for row in moving(rrd, "/arena/world/robots") if row["Points2D:positions"]]


def test_robots_are_drawn_from_their_initial_positions(folder: Path, rrd: Path) -> None:
    """The first row has them near their initial positions; they move on from there."""
    config = small("seed=10")
    arena = Arena(config.robots, config.arena, config.body, config.seed)
    shown = drawn_robots(rrd)
    first = np.array(shown[0]["Points2D:positions"])
    farthest_m = 2 * max(config.learning.speeds_m_s) * config.arena.control_period_s + 0.12
    assert np.abs(first - arena.world.poses[:, :2]).max() < farthest_m
    last = np.array(shown[-1]["Points2D:positions"])
    assert np.abs(last - first).max() > 0.05


def test_every_generation_is_drawn_as_in_the_table(folder: Path, rrd: Path) -> None:
    """The mean matings are those of `generations.csv`."""
    table = {int(row["generation"]): row for row in read_table(folder / "generations.csv")}
    drawn = {
        row["generation"]: row["Measurements:values"][0]
        for row in moving(rrd, "/evolution/matings/colony")
    }
    assert drawn.keys() == table.keys()
    for generation, mean in drawn.items():
        assert mean == pytest.approx(float(table[generation]["matings"]))


def test_all_tabs_have_something_to_show(rrd: Path) -> None:
    """Family tree, log, energy, network, agent and status."""
    assert moving(rrd, "/lineage/family")
    lines = [row["TextLog:text"][0] for row in moving(rrd, "/log/mating")]
    assert any("mated with" in line for line in lines)
    for entity in ("/life/energy/robot_0", "/network/robots", "/evolution/agent", "/arena/now"):
        assert moving(rrd, entity), entity


def test_recorded_telemetry_is_drawn_like_the_run_itself(
    folder: Path, rrd: Path, tmp_path: Path
) -> None:
    """A telemetry file of the same colony shows the same robots at the same moments of its time."""
    samples = resimulate(read_run(folder), WINDOWS)
    record(tmp_path / "watched" / TELEMETRY_FILE, map(raw_sample, samples))
    run_replay(tmp_path / "watched", None, WINDOWS)
    again = tmp_path / "watched" / REPLAY_FILE
    simulated, recorded = (
        {row["sim"]: row["Points2D:positions"] for row in drawn_robots(path)}
        for path in (rrd, again)
    )
    both = simulated.keys() & recorded.keys()
    assert len(both) > 2 * 20
    assert all(simulated[when] == recorded[when] for when in both)
    figures = [moving(path, "/evolution/matings/colony") for path in (rrd, again)]
    assert figures[0] == figures[1]


def test_of_a_real_time_run_without_a_recording_the_history_is_drawn(
    folder: Path, tmp_path: Path
) -> None:
    """Generations and family tree; the robots' positions are unknown."""
    copy = tmp_path / "launched"
    shutil.copytree(folder, copy)
    record = json.loads((copy / "run.json").read_text())
    robots = [seeded("others", 10, number).id.hex() for number in range(4)]
    (copy / "run.json").write_text(json.dumps({**record, "robots": robots}))
    run_replay(copy, None, WINDOWS)
    rrd = copy / REPLAY_FILE
    assert len(moving(rrd, "/evolution/matings/colony")) == 3
    assert moving(rrd, "/lineage/family")
    assert not drawn_robots(rrd)


def test_a_run_with_another_history_is_drawn_and_reported(folder: Path, tmp_path: Path) -> None:
    """The replay shows the run as it is with the present code."""
    copy = tmp_path / "other"
    shutil.copytree(folder, copy)
    record = json.loads((copy / "run.json").read_text())
    (copy / "run.json").write_text(json.dumps({**record, "history_hash": "00" * 16}))
    with pytest.raises(HistoryDiffersError, match="re-simulated"):
        run_replay(copy, None, WINDOWS)
    assert moving(copy / REPLAY_FILE, "/evolution/matings/colony")


def test_what_cannot_be_read_leaves_no_file(tmp_path: Path) -> None:
    """Neither a folder without a run, nor a file of another kind."""
    other = tmp_path / "notes.txt"
    other.write_text("no telemetry")
    with pytest.raises(TelemetryError, match=r"notes\.txt"):
        run_replay(other, None, WINDOWS)
    with pytest.raises(PastRunError, match="missing"):
        run_replay(tmp_path, None, WINDOWS)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]
