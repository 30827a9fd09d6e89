"""What was heard of a run, wherever that is to be had: recorded, lived again, or told from its history."""

from collections.abc import Iterator
from pathlib import Path

from crcolony.recordings.past_run import PastRunError, read_run
from crcolony.recordings.resimulation import Windows, beginning_of, from_history, resimulate
from crcolony.recordings.telemetry_file import FILE_NAME, read_heard
from crcolony.telemetry.colony_monitor import Heard


def heard_of(path: Path, windows: Windows | None = None) -> Iterator[Heard]:
    """Yield what was heard of a run: `path` is a telemetry file, or a folder with one, or a results folder.

    `windows` say what of a run that is lived again is shown in full. Raises TelemetryError, PastRunError or
    ConfigError at once or while it is read, and HistoryDiffersError when all is read.
    """
    file = _recording_in(path)
    if file is not None:
        return read_heard(file)
    run = read_run(path)
    return resimulate(run, windows) if run.is_repeatable else from_history(run)


def is_recorded(path: Path) -> bool:
    """Tell whether what was heard is there as it came; raises PastRunError if nothing is there at all."""
    return _recording_in(path) is not None


def abouts_of(path: Path) -> Iterator[Heard]:
    """Yield what robots and arenas of a run have answered about themselves; raises as `heard_of` does."""
    file = _recording_in(path)
    heard = beginning_of(read_run(path)) if file is None else read_heard(file, ["about"])
    return (one for one in heard if one.kind == "about")


def _recording_in(path: Path) -> Path | None:
    if not path.exists():
        raise PastRunError(f"{path}: there is no such file or folder")
    file = path / FILE_NAME if path.is_dir() else path
    return file if file.is_file() else None
