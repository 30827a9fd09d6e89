"""A recording holds what was drawn; it ends when the disk is full, and is optimized when it is complete."""

import datetime
import errno
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import rerun as rr
import rerun.blueprint as rrb
from crcolony_dashboards.dashboard import Dashboard
from crcolony_dashboards.preconditions import DashboardError
from crcolony_dashboards.rerun_streams import Moment, RerunStreams
from crcolony_dashboards.rrd_file import RrdFile, exit_if_stuck, open_rrd, optimize_rrd
from rerun.chunk import RrdReader

from crcolony.errors import EXIT_OK
from crcolony.telemetry.colony_monitor import ColonyMonitor
from tests.support.fake_telemetry import T

Rows = list[dict[str, Any]]
pytestmark = pytest.mark.filterwarnings("ignore:RRD file has no footer")
"""A recording has none before it is put in order."""


def blueprint() -> rrb.Blueprint:
    return rrb.Blueprint(rrb.TextLogView(origin="/log"))


def rrd(path: Path) -> RrdFile:
    return open_rrd(path, "run", blueprint())


def rows(path: Path, entity: str) -> Rows:
    """Return the rows of an entity in a recording, in order, without Rerun's own columns."""
    found: Rows = []
    for chunk in RrdReader(path).stream():
        if chunk.entity_path == entity:
            for row in chunk.to_record_batch().to_pylist():
                found.append({k: v for k, v in row.items() if not k.startswith("rerun.")})
    return found


class FakeStream:
    """A recording stream that fails to write, as on a full disk."""

    def __init__(self) -> None:
        self.is_full = False
        self.is_open = True
        self.drawn: list[str] = []

    def set_time(self, timeline: str, **when: Any) -> None:
        pass

    def disable_timeline(self, timeline: str) -> None:
        pass

    def log(self, path: str, *what: Any, **how: Any) -> None:
        assert self.is_open
        self.drawn.append(path)

    def flush(self, *, timeout_sec: float) -> None:
        if self.is_full:
            raise RuntimeError("the file sink has gone")

    def disconnect(self) -> None:
        self.is_open = False


class TestRecording:
    """A recording holds what was drawn, and when."""

    def test_what_is_drawn_is_read_back(self, tmp_path: Path) -> None:
        """On all three timelines; static data have no time."""
        path = tmp_path / "new" / "recording.rrd"
        streams = RerunStreams(None, rrd(path))
        streams.log("/life/energy", rr.SeriesLines(names=["low", "high"]), static=True)
        for k in range(3):
            streams.set_time(Moment(T + k, 10.0 * k, 7))
            streams.log("/life/energy", rr.Scalars([0.25 * k, 0.5]))
        streams.close()
        static, *moments = sorted(rows(path, "/life/energy"), key=lambda row: "wall" in row)
        assert static == {"SeriesLines:names": ["low", "high"]}
        assert moments == [
            {
                "wall": datetime.datetime.fromtimestamp(T + k, datetime.UTC).replace(tzinfo=None),
                "sim": datetime.timedelta(seconds=10.0 * k),
                "generation": 7,
                "Scalars:scalars": [0.25 * k, 0.5],
            }
            for k in range(3)
        ]

    def test_it_has_the_layout_of_the_dashboard(self, tmp_path: Path) -> None:
        """And the recording id, under which a viewer merges a live dashboard with its recording."""
        path = tmp_path / "recording.rrd"
        dashboard = Dashboard(ColonyMonitor())
        made = open_rrd(path, "run-7", dashboard.blueprint("sim", is_live=False))
        streams = RerunStreams(None, made)
        dashboard.setup(streams)
        dashboard.draw(streams, T)
        streams.close()
        reader = RrdReader(path)
        (recording,), (layout,) = reader.recordings(), reader.blueprints()
        assert (recording.application_id, recording.recording_id) == ("crcolony", "run-7")
        assert layout.application_id == "crcolony"
        assert rows(path, "/network/robots")[0]["TextDocument:text"] == [
            "No robot is on the network yet."
        ]

    def test_an_old_file_is_replaced(self, tmp_path: Path) -> None:
        """Callers choose an unused path if they want to keep it."""
        path = tmp_path / "recording.rrd"
        path.write_bytes(b"something else")
        RerunStreams(None, rrd(path)).close()
        assert RrdReader(path).recordings()[0].recording_id == "run"

    def test_a_path_that_cannot_be_written_is_refused(self, tmp_path: Path) -> None:
        """Neither in a folder that is a file, nor in place of a folder."""
        (tmp_path / "file").touch()
        for path in (tmp_path / "file" / "recording.rrd", tmp_path):
            with pytest.raises(DashboardError) as refusal:
                rrd(path)
            assert str(refusal.value).startswith(f"{path}: cannot be written: ")
            assert "\n" not in str(refusal.value)

    def test_it_can_be_read_while_it_is_recorded(self, tmp_path: Path) -> None:
        """Up to the last flush: that is what a dashboard that is killed leaves behind."""
        path = tmp_path / "recording.rrd"
        made = rrd(path)
        streams = RerunStreams(None, made)
        streams.set_time(Moment(T, 0.0, 0))
        streams.log("/log/x", rr.TextLog("x"))
        assert made.check() is None
        copy = shutil.copy(path, tmp_path / "copy.rrd")
        assert len(rows(Path(copy), "/log/x")) == 1
        streams.close()


def no_room(path: object) -> Any:
    return SimpleNamespace(free=1_000)


def no_disk(path: object) -> Any:
    raise OSError(errno.EIO, os.strerror(errno.EIO))


class TestFullDisk:
    """A full disk ends the recording, and nothing else."""

    def test_a_recording_that_cannot_be_written_ends_with_one_message(self, tmp_path: Path) -> None:
        """The live stream continues."""
        live, broken = FakeStream(), FakeStream()
        made = RrdFile(tmp_path / "recording.rrd", broken)  # type: ignore[arg-type]
        streams = RerunStreams(live, made)  # type: ignore[arg-type]
        streams.set_time(Moment(T, 0.0, 0))
        streams.log("/a", rr.TextLog("x"))
        assert made.check() is None
        broken.is_full = True
        why = "not recorded any more: cannot be written: the file sink has gone"
        assert [made.check(), made.check()] == [f"{tmp_path / 'recording.rrd'}: {why}", None]
        streams.set_time(Moment(T + 1.0, 1.0, 0))
        streams.log("/b", rr.TextLog("x"))
        assert (live.drawn, broken.drawn) == (["/a", "/b"], ["/a"])
        streams.close()
        assert not live.is_open

    def test_a_process_with_a_stuck_recording_exits_at_once(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """Since it would never end; with a recording that could be closed it does not."""
        ends: list[int] = []
        monkeypatch.setattr(os, "_exit", ends.append)
        stuck, healthy = FakeStream(), FakeStream()
        recordings = [RrdFile(tmp_path / "x", stream) for stream in (stuck, healthy)]  # type: ignore[arg-type]
        stuck.is_full = True
        for made in recordings:
            made.check()
            made.close()
        assert [made.is_stuck for made in recordings] == [True, False]
        exit_if_stuck(None)
        exit_if_stuck(recordings[1])
        assert ends == []
        exit_if_stuck(recordings[0])
        assert ends == [EXIT_OK]
        assert (stuck.is_open, healthy.is_open) == (True, False)

    @pytest.mark.parametrize(("usage", "number"), [(no_room, errno.ENOSPC), (no_disk, errno.EIO)])
    def test_a_recording_ends_before_the_disk_is_full(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, usage: Callable[..., Any],
        number: int,
    ) -> None:  # fmt: skip
        """Or when the disk has failed; what was drawn until then can be read."""
        path = tmp_path / "recording.rrd"
        made = rrd(path)
        streams = RerunStreams(None, made)
        streams.set_time(Moment(T, 0.0, 0))
        streams.log("/a", rr.TextLog("x"))
        monkeypatch.setattr(shutil, "disk_usage", usage)
        assert made.check() == f"{path}: not recorded any more: {os.strerror(number)}"
        monkeypatch.undo()
        streams.log("/a", rr.TextLog("y"))
        streams.close()
        assert [row["TextLog:text"] for row in rows(path, "/a")] == [["x"]]


def test_an_optimized_recording_has_an_index_and_is_smaller(tmp_path: Path) -> None:
    """It holds the same data."""
    path = tmp_path / "recording.rrd"
    rrd = open_rrd(path, "run", rrb.Blueprint(rrb.TextLogView(origin="/log")))
    streams = RerunStreams(None, rrd)
    for k in range(50):
        streams.set_time(Moment(1.79e9 + k, 1.0 * k, 0))
        streams.log("/a", rr.Points2D([(k, 0.0)]))
        assert rrd.check() is None
    streams.close()
    before = path.stat().st_size
    optimize_rrd(path)
    assert path.stat().st_size < before
    assert [file.name for file in tmp_path.iterdir()] == ["recording.rrd"]
    assert RrdReader(path).store() is not None
    points = [chunk.num_rows for chunk in RrdReader(path).stream() if chunk.entity_path == "/a"]
    assert sum(points) == 50


def test_another_file_is_not_changed(tmp_path: Path) -> None:
    """And nothing is left beside it."""
    path = tmp_path / "recording.rrd"
    path.write_bytes(b"other")
    optimize_rrd(path)
    assert path.read_bytes() == b"other"
    assert [file.name for file in tmp_path.iterdir()] == ["recording.rrd"]
