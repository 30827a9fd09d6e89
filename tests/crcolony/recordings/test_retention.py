"""A recording of weeks keeps every event, and of poses and states the last hours; then its file grows no more."""

from pathlib import Path

from crcolony.recordings.retention import Retention
from crcolony.recordings.telemetry_file import TelemetryFile, read_samples
from crcolony.telemetry.samples import RawSample, SampleKind

NOW_MS = 1_790_000_000_000
HOUR_S, MINUTE_MS = 3600.0, 60_000


def sample(kind: SampleKind, minute: int) -> RawSample:
    return RawSample(kind, f"key/{minute}", bytes(1000), NOW_MS + minute * MINUTE_MS)


def record(path: Path, minutes: range, keep_s: float | None = HOUR_S) -> int:
    """Record a state, a pose and an event a minute; return the size of the file."""
    file = TelemetryFile.open(path, Retention(keep_s) if keep_s is not None else None)
    for minute in minutes:
        for kind in ("online", "state", "scene", "event"):
            file.add(sample(kind, minute))
        assert file.commit() is None
    file.close()
    return path.stat().st_size


def kept(path: Path, kind: SampleKind) -> list[int]:
    """Return the minutes of which there is a sample."""
    return [(s.unix_ms - NOW_MS) // MINUTE_MS for s in read_samples(path, [kind]) if s.payload]


def test_old_poses_and_states_are_deleted_and_events_stay(tmp_path: Path) -> None:
    """Those of the last hour are all there, and every event and token."""
    path = tmp_path / "telemetry.sqlite"
    record(path, range(200))
    assert kept(path, "state") == kept(path, "scene") == list(range(139, 200))
    assert kept(path, "event") == kept(path, "online") == list(range(200))


def test_it_goes_on_where_an_earlier_recording_ended(tmp_path: Path) -> None:
    """Also one that kept everything until then."""
    path = tmp_path / "telemetry.sqlite"
    record(path, range(100), keep_s=None)
    assert len(kept(path, "state")) == 100
    record(path, range(100, 120))
    assert kept(path, "state") == list(range(59, 120))


def test_the_file_grows_no_more_but_for_events(tmp_path: Path) -> None:
    """The room of what was deleted is used again."""
    path = tmp_path / "telemetry.sqlite"
    first = record(path, range(500))
    second = record(path, range(500, 1000))
    per_minute = (second - first) / 500
    assert per_minute < 3_000, "an event and a token of 1,000 bytes a minute, not four samples"
    assert first < record(tmp_path / "all.sqlite", range(500), keep_s=None)


def test_a_clock_that_is_set_back_deletes_nothing_that_is_new(tmp_path: Path) -> None:
    """What arrives then is older than what came before, and stays until it is too old itself."""
    path = tmp_path / "telemetry.sqlite"
    record(path, range(100, 120))
    record(path, range(20))
    assert set(range(20)) <= set(kept(path, "state"))
