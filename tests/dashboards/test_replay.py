"""A run that has ended is drawn in the same dashboard, whatever its folder holds."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
import pytest
from crcolony_dashboards.replay import REPLAY_FILE, run_replay
from crcolony_dashboards.rerun_streams import ARENA_TIMELINE
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.tabs.colony_story import EVOLVED, STATUS
from rerun.chunk import RrdReader

from crcolony.protocol.identity import seeded
from crcolony.recordings.past_run import PastRunError, read_run
from crcolony.recordings.resimulation import HistoryDiffersError, Windows, resimulate
from crcolony.recordings.telemetry_file import TELEMETRY_FILE
from crcolony.recordings.telemetry_schema import TelemetryError
from crcolony.results.generation_table import read_table
from crcolony.telemetry.samples import SceneSample
from crcolony.world.arena import Arena
from tests.support.raw_samples import raw_sample, record
from tests.support.run_folders import run
from tests.support.small_colony import small

WINDOWS = Windows(length_s=5.0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of six generations."""
    folder = tmp_path_factory.mktemp("runs") / "run"
    run(folder, small("seed=10", "generations=6"))
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


def mating_lines(rrd: Path) -> list[list[list[list[float]]]]:
    """Return the lines of matings by generation, every time that they are drawn."""
    return [row["LineStrips2D:strips"] for row in moving(rrd, "/colony/matings/lines")]


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
    """Founders and the last generation are those of `generations.csv`, and the line has a point for each."""
    table = read_table(folder / "generations.csv")
    text = moving(rrd, EVOLVED)[-1]["TextDocument:text"][0]
    first, last = (float(table[k]["matings"]) for k in (0, -1))
    assert f"| matings of an agent | {first:.2f} | {last:.2f} |" in text
    assert len(mating_lines(rrd)[-1][-1]) == len(table) == 6


def test_all_tabs_have_something_to_show(rrd: Path) -> None:
    """Family tree, log, energy, network, agent and status."""
    assert moving(rrd, "/lineage/family")
    lines = [row["TextLog:text"][0] for row in moving(rrd, "/log")]
    assert any(" mated; " in line for line in lines)
    for entity in ("/life/energy/robot_0", "/network/robots", "/genes/agent", STATUS):
        assert moving(rrd, entity), entity


def opening_s(rrd: Path) -> dict[str, float]:
    """Return of every entity on the timeline that a viewer opens with when it is drawn first on it (s)."""
    first: dict[str, float] = {}
    for chunk in RrdReader(rrd).stream():
        batch = chunk.to_record_batch()
        if ARENA_TIMELINE in batch.schema.names:
            at_s = min(batch.column(ARENA_TIMELINE).cast(pa.int64()).to_pylist()) / 1e9
            first[chunk.entity_path] = min(at_s, first.get(chunk.entity_path, at_s))
    return first


SHOWN_AT_ONCE = (
    "/arena/world/robots",
    "/arena/world/packs",
    "/colony/matings/lines",
    EVOLVED,
    STATUS,
)


def test_a_replay_opens_with_the_arena_of_the_last_generation(folder: Path, rrd: Path) -> None:
    """At the start of its timeline everything is in view: the arena, and what has evolved before."""
    first = opening_s(rrd)
    start_s = min(first.values())
    config = small("seed=10", "generations=6")
    life = config.life
    steps = 5 * life.agents * life.slices * life.slice_steps
    assert start_s == pytest.approx(steps * config.arena.control_period_s, abs=0.5)
    assert {path: first[path] for path in SHOWN_AT_ONCE} == dict.fromkeys(SHOWN_AT_ONCE, start_s)
    assert palette.STALE not in [
        tuple(colour >> shift & 255 for shift in (24, 16, 8))
        for row in moving(rrd, "/arena/world/energy")
        if row["sim"] == round(1e9 * start_s)
        for colour in row["Points2D:colors"]
    ]


def test_a_replay_of_a_recording_opens_with_its_end(folder: Path, tmp_path: Path) -> None:
    """With the last seconds that have scenes."""
    samples = list(resimulate(read_run(folder), WINDOWS))
    record(tmp_path / TELEMETRY_FILE, map(raw_sample, samples))
    run_replay(tmp_path, None, Windows(length_s=2.0))
    first = opening_s(tmp_path / REPLAY_FILE)
    scenes = [sample.scene for sample in samples if isinstance(sample, SceneSample)]
    last_s = scenes[-1].tick * scenes[-1].period_s
    assert min(first.values()) == pytest.approx(last_s - 2.0, abs=0.3)
    assert all(path in first for path in SHOWN_AT_ONCE)


def test_a_replay_without_an_arena_opens_with_the_last_generation(
    folder: Path, tmp_path: Path
) -> None:
    """With all its charts."""
    rrd = without_recording(folder, tmp_path)
    assert opening_s(rrd)["/colony/matings/lines"] == min(opening_s(rrd).values())


def without_recording(folder: Path, tmp_path: Path) -> Path:
    """Return the replay of a run in real time that nobody recorded."""
    copy = tmp_path / "launched"
    shutil.copytree(folder, copy)
    record = json.loads((copy / "run.json").read_text())
    robots = [seeded("others", 10, number).id.hex() for number in range(4)]
    (copy / "run.json").write_text(json.dumps({**record, "robots": robots}))
    run_replay(copy, None, WINDOWS)
    return copy / REPLAY_FILE


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
    assert mating_lines(rrd)[-1] == mating_lines(again)[-1]


def test_of_a_real_time_run_without_a_recording_the_history_is_drawn(
    folder: Path, tmp_path: Path
) -> None:
    """Generations and family tree; the robots' positions are unknown."""
    rrd = without_recording(folder, tmp_path)
    assert len(mating_lines(rrd)[-1][-1]) == 6
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
    assert mating_lines(copy / REPLAY_FILE)


def test_what_cannot_be_read_leaves_no_file(tmp_path: Path) -> None:
    """Neither a folder without a run, nor a file of another kind."""
    other = tmp_path / "notes.txt"
    other.write_text("no telemetry")
    with pytest.raises(TelemetryError, match=r"notes\.txt"):
        run_replay(other, None, WINDOWS)
    with pytest.raises(PastRunError, match="missing"):
        run_replay(tmp_path, None, WINDOWS)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]
