"""The telemetry of a run is read from its recording if there is one, and else made from its results folder."""

from pathlib import Path

import pytest

from crcolony.recordings.past_run import PastRunError
from crcolony.recordings.sources import is_recorded, metadata_samples_of, samples_of
from crcolony.recordings.telemetry_file import TELEMETRY_FILE
from crcolony.telemetry.samples import MalformedSample, RawSample, TelemetrySample
from tests.support.raw_samples import raw_sample, record


def test_a_run_without_a_recording_is_resimulated(
    folder: Path, samples: list[TelemetrySample]
) -> None:
    """It is a results folder."""
    assert not is_recorded(folder)
    assert list(samples_of(folder)) == samples


def test_a_recording_is_read(tmp_path: Path, samples: list[TelemetrySample]) -> None:
    """As a file, or as a folder with one; what is malformed in it is a malformed sample."""
    some = samples[:100]
    noise = RawSample("state", "nobody", b"", samples[99].unix_ms)
    path = record(tmp_path / TELEMETRY_FILE, [*map(raw_sample, some), noise])
    for source in (path, tmp_path):
        assert is_recorded(source)
        *read, last = samples_of(source)
        assert read == some
        assert isinstance(last, MalformedSample)


def test_the_metadata_is_known_without_a_simulation(
    folder: Path, tmp_path: Path, samples: list[TelemetrySample]
) -> None:
    """The same as in the whole run, and as in a recording of it."""
    metadata = [sample for sample in samples if sample.kind == "metadata"]
    assert len(metadata) == 5
    assert list(metadata_samples_of(folder)) == metadata
    path = record(tmp_path / TELEMETRY_FILE, map(raw_sample, samples[:100]))
    assert list(metadata_samples_of(path)) == metadata


def test_a_missing_path_is_named(tmp_path: Path) -> None:
    """In one line."""
    for use in (samples_of, is_recorded, metadata_samples_of):
        with pytest.raises(PastRunError, match="nowhere: there is no such file or folder"):
            use(tmp_path / "nowhere")
