"""The telemetry of a run, from wherever it can be had: recorded, re-simulated, or synthesised from its history."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from crcolony.recordings.past_run import PastRunError, read_run
from crcolony.recordings.resimulation import (
    Windows,
    from_history,
    initial_samples,
    resimulate,
    window_generations,
)
from crcolony.recordings.telemetry_file import TELEMETRY_FILE, last_scene_unix_ms, read_samples
from crcolony.telemetry.samples import (
    ArenaMetadataSample,
    RobotMetadataSample,
    SceneSample,
    TelemetrySample,
    parse_sample,
)


@dataclass(frozen=True)
class Opening:
    """Where a replay opens: with the first scene that is neither before this time nor before this generation."""

    unix_ms: int = 0
    generation: int = 0

    def includes(self, scene: SceneSample, generation: int) -> bool:
        """Return whether a scene of a generation is in the stretch that a replay opens with."""
        return scene.unix_ms >= self.unix_ms and generation >= self.generation


def opening_of(path: Path, windows: Windows) -> Opening:
    """Return where the replay of a run opens: with the end of its recording, or with the last window.

    Raises the errors of `samples_of`.
    """
    file = _recording_in(path)
    if file is not None:
        return Opening(unix_ms=last_scene_unix_ms(file) - round(1000.0 * windows.length_s))
    run = read_run(path)
    shown = (number for number in window_generations(windows, run) if number <= run.generations)
    return Opening(generation=max(shown, default=0))


def samples_of(path: Path, windows: Windows | None = None) -> Iterator[TelemetrySample]:
    """Yield the telemetry of a run; `path` is a telemetry file, a folder with one, or a results folder.

    `windows` are the parts of a re-simulated run with scenes. Raises TelemetryError, PastRunError or ConfigError at
    once or during the iteration, and HistoryDiffersError at its end.
    """
    file = _recording_in(path)
    if file is not None:
        return map(parse_sample, read_samples(file))
    run = read_run(path)
    return resimulate(run, windows) if run.is_repeatable else from_history(run)


def is_recorded(path: Path) -> bool:
    """Return whether there is a recording; raises PastRunError if there is no such path."""
    return _recording_in(path) is not None


def metadata_samples_of(path: Path) -> Iterator[TelemetrySample]:
    """Yield the metadata of the robots and arenas of a run; raises the errors of `samples_of`."""
    file = _recording_in(path)
    samples = (
        initial_samples(read_run(path))
        if file is None
        else map(parse_sample, read_samples(file, ["metadata"]))
    )
    return (s for s in samples if isinstance(s, RobotMetadataSample | ArenaMetadataSample))


def _recording_in(path: Path) -> Path | None:
    if not path.exists():
        raise PastRunError(f"{path}: there is no such file or folder")
    file = path / TELEMETRY_FILE if path.is_dir() else path
    return file if file.is_file() else None
