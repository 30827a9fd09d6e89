"""A dashboard records once, all that it has received, and never over another recording."""

from pathlib import Path

import pytest
import rerun.blueprint as rrb
from crcolony_dashboards.recording import RRD_FILE, Recording, unused_path

from crcolony.recordings.telemetry_file import TELEMETRY_FILE, read_samples
from crcolony.telemetry.samples import RawSample

LINES: list[str] = []


def sample(number: int) -> RawSample:
    return RawSample("state", f"key/{number}", b"x", 1_000 + number)


def recorded(folder: Path) -> list[str]:
    return [sample.key for sample in read_samples(folder / TELEMETRY_FILE)]


def test_what_was_received_before_it_was_opened_is_recorded(tmp_path: Path) -> None:
    """In order; afterwards the folder can be recorded into again."""
    for start in (0, 3):
        recording = Recording("run")
        recording.add(sample(start))
        assert not recording.is_decided
        assert recording.open(tmp_path, rrb.Blueprint()) == f"recorded into {tmp_path}"
        recording.add(sample(start + 1))
        assert recording.commit() == []
        recording.close(LINES.append)
    assert recorded(tmp_path) == ["key/0", "key/1", "key/3", "key/4"]
    assert (tmp_path / RRD_FILE).is_file()
    assert (tmp_path / "dashboard-2.rrd").is_file()
    assert LINES == []


def test_a_folder_is_recorded_into_by_one_dashboard_at_a_time(tmp_path: Path) -> None:
    """The second one leaves it alone and says so."""
    first, second = Recording("first"), Recording("second")
    first.open(tmp_path, rrb.Blueprint())
    assert "another dashboard records into" in second.open(tmp_path, rrb.Blueprint())
    for recording in (second, first):
        recording.add(sample(1))
        recording.close(LINES.append)
    assert recorded(tmp_path) == ["key/1"]
    assert not (tmp_path / "dashboard-2.rrd").exists()


def test_nothing_is_recorded_if_it_is_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And nothing waits in memory."""
    monkeypatch.chdir(tmp_path)
    recording = Recording("run")
    recording.leave_out()
    recording.add(sample(1))
    recording.close(LINES.append)
    assert list(tmp_path.iterdir()) == []


def test_no_recording_is_overwritten(tmp_path: Path) -> None:
    """The next one has the next number."""
    rrd = tmp_path / RRD_FILE
    for name in ("dashboard.rrd", "dashboard-2.rrd", "dashboard-3.rrd"):
        free = unused_path(rrd)
        assert free.name == name
        free.touch()


def test_a_recording_of_weeks_has_no_rrd(tmp_path: Path) -> None:
    """Nothing of an .rrd can be deleted; what was recorded is drawn again by crcolony replay."""
    recording = Recording("run", keep_s=7200.0)
    assert recording.open(tmp_path, rrb.Blueprint()).endswith(
        "events for good, the rest for 2 hours"
    )
    for number in (1, 7_300_000):
        recording.add(sample(number))
        assert recording.commit() == []
    recording.close(LINES.append)
    assert recorded(tmp_path) == ["key/7300000"]
    assert not list(tmp_path.glob("*.rrd"))
