"""The stretch that a replay opens with begins with all that was drawn before."""

from pathlib import Path
from typing import Any

import pytest
import rerun as rr
import rerun.blueprint as rrb
from crcolony_dashboards.replay_streams import ReplayStreams
from crcolony_dashboards.rerun_streams import ARENA_TIMELINE, Moment
from crcolony_dashboards.rrd_file import open_rrd, optimize_rrd
from rerun.chunk import RrdReader


@pytest.fixture
def streams(tmp_path: Path) -> ReplayStreams:
    return ReplayStreams(open_rrd(tmp_path / "replay.rrd", "replay", rrb.Blueprint()))


def stretch(streams: ReplayStreams) -> dict[str, list[Any]]:
    """Close the recording; return of every entity what is on the timeline of the stretch, with its time."""
    assert streams.rrd is not None
    streams.close()
    optimize_rrd(streams.rrd.path)
    found: dict[str, list[Any]] = {}
    for chunk in RrdReader(streams.rrd.path).stream():
        batch = chunk.to_record_batch()
        if ARENA_TIMELINE not in batch.schema.names:
            continue
        (column,) = (name for name in batch.schema.names if name.endswith(":text"))
        times = [time.total_seconds() for time in batch.column(ARENA_TIMELINE).to_pylist()]
        rows = zip(times, batch.column(column).to_pylist(), strict=True)
        found.setdefault(chunk.entity_path, []).extend(rows)
    return found


def test_the_stretch_begins_with_the_last_drawings(streams: ReplayStreams) -> None:
    """What was drawn before it is drawn again at its start, what was removed is not."""
    streams.set_time(Moment(1e9, 10.0, 0))
    for text in ("old", "new"):
        streams.log("/kept", rr.TextDocument(text))
    streams.log("/removed/below", rr.TextDocument("old"))
    streams.log("/removed", rr.Clear(recursive=True))
    streams.log("/log", rr.TextLog("first"))
    streams.log("/log", rr.TextLog("second"))
    streams.open()
    streams.show(has_scenes=True)
    streams.set_time(Moment(1e9 + 1.0, 11.0, 0))
    streams.log("/kept", rr.TextDocument("in the stretch"))
    streams.show(has_scenes=False)
    streams.set_time(Moment(1e9 + 2.0, 12.0, 0))
    streams.log("/kept", rr.TextDocument("after it"))
    assert stretch(streams) == {
        "/kept": [(10.0, ["new"]), (11.0, ["in the stretch"])],
        "/log": [(10.0, ["first"]), (10.0, ["second"])],
    }


def test_before_it_is_opened_there_is_no_stretch(streams: ReplayStreams) -> None:
    """Scenes alone do not begin it."""
    streams.show(has_scenes=True)
    streams.set_time(Moment(1e9, 10.0, 0))
    streams.log("/kept", rr.TextDocument("before"))
    assert not streams.is_open
    assert stretch(streams) == {}
