"""What was heard of a run, wherever that is to be had: recorded, lived again, or told from its history."""

from collections.abc import Iterator
from pathlib import Path

from crcolony.recordings.past_run import PastRunError, read_run
from crcolony.recordings.resimulation import Windows, from_history, initial_samples, resimulate
from crcolony.recordings.telemetry_file import TELEMETRY_FILE, read_samples
from crcolony.telemetry.colony_monitor import TelemetrySample


def samples_of(path: Path, windows: Windows | None = None) -> Iterator[TelemetrySample]:
    """Yield what was heard of a run: `path` is a telemetry file, or a folder with one, or a results folder.

    `windows` say what of a run that is lived again is shown in full. Raises TelemetryError, PastRunError or
    ConfigError at once or while it is read, and HistoryDiffersError when all is read.
    """
    file = _recording_in(path)
    if file is not None:
        return read_samples(file)
    run = read_run(path)
    return resimulate(run, windows) if run.is_repeatable else from_history(run)


def is_recorded(path: Path) -> bool:
    """Tell whether what was heard is there as it came; raises PastRunError if nothing is there at all."""
    return _recording_in(path) is not None


def metadata_samples_of(path: Path) -> Iterator[TelemetrySample]:
    """Yield what robots and arenas of a run have answered about themselves; raises as `samples_of` does."""
    file = _recording_in(path)
    sample = initial_samples(read_run(path)) if file is None else read_samples(file, ["metadata"])
    return (one for one in sample if one.kind == "metadata")


def _recording_in(path: Path) -> Path | None:
    if not path.exists():
        raise PastRunError(f"{path}: there is no such file or folder")
    file = path / TELEMETRY_FILE if path.is_dir() else path
    return file if file.is_file() else None
