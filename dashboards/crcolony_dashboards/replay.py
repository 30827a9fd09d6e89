"""The dashboard of a run that has ended, as a recording (.rrd): from its recorded telemetry, or re-simulated."""

import itertools
from collections.abc import Iterable
from pathlib import Path

from crcolony.recordings.resimulation import Windows
from crcolony.recordings.sources import Opening, is_recorded, opening_of, samples_of
from crcolony.telemetry.colony_monitor import ColonyMonitor
from crcolony.telemetry.samples import SceneSample, TelemetrySample
from crcolony_dashboards.dashboard import Dashboard
from crcolony_dashboards.preconditions import DashboardError, check_rerun
from crcolony_dashboards.replay_streams import ReplayStreams
from crcolony_dashboards.rerun_streams import ARENA_TIMELINE
from crcolony_dashboards.rrd_file import RrdFile, exit_if_stuck, open_rrd, optimize_rrd
from crcolony_dashboards.throttle import Throttle
from crcolony_dashboards.viewers import open_file

REPLAY_FILE = "replay.rrd"
_DRAW_PERIOD_S = 0.1
"""Of the colony's time, while there are scenes"""
_COARSE_PERIOD_S = 600.0
"""Of the colony's time, while a re-simulated run has no scenes"""
_SCENE_TIMEOUT_S = 2.0
"""So long after a scene it is still drawn at the fine period"""


def run_replay(
    path: Path, out: Path | None, windows: Windows, agent: str = "", native: bool = False
) -> None:
    """Draw the dashboard of a run's folder (or of one telemetry file) into `out`, and open it if `native`.

    Raises CrcolonyError if there is no telemetry, if the recording cannot be written, or if a re-simulated run differs
    from the recorded history (the recording is complete then).
    """
    check_rerun()
    target = out or (path if path.is_dir() else path.parent) / REPLAY_FILE
    samples = samples_of(path, windows)
    first = next(samples, None)  # before the file is opened: what cannot be read leaves no file
    if first is None:
        raise DashboardError(f"{path}: no telemetry")
    dashboard = Dashboard(ColonyMonitor(), agent)
    draft = target.with_name(target.name + ".part")
    rrd = open_rrd(draft, "replay", dashboard.blueprint(ARENA_TIMELINE, is_live=False))
    error: str | None = None
    try:
        coarse_s = _DRAW_PERIOD_S if is_recorded(path) else _COARSE_PERIOD_S
        draw_samples(
            itertools.chain([first], samples), dashboard, rrd, coarse_s, opening_of(path, windows)
        )
    finally:
        error = rrd.check()
        rrd.close()
        if error is None:
            optimize_rrd(draft)
            draft.replace(target)
            print(target, flush=True)
    if error is not None:
        exit_if_stuck(rrd, error)
        raise DashboardError(error)
    if native:
        open_file(target)


def draw_samples(
    samples: Iterable[TelemetrySample],
    dashboard: Dashboard,
    rrd: RrdFile,
    coarse_s: float,
    opening: Opening,
) -> None:
    """Draw samples at their own times, ten times a second; without scenes only every `coarse_s` seconds.

    Viewers open it at the first scene of the opening, or at the end if there is none.
    """
    streams, fine, coarse = ReplayStreams(rrd), Throttle(_DRAW_PERIOD_S), Throttle(coarse_s)
    dashboard.setup(streams)
    now_s = scene_s = 0.0
    for sample in samples:
        before_s, now_s = now_s, sample.unix_ms / 1000.0
        has_scenes = before_s - scene_s < _SCENE_TIMEOUT_S
        streams.show(has_scenes)
        if now_s > before_s > 0.0 and (fine if has_scenes else coarse).is_due(before_s):
            dashboard.draw(streams, before_s)
        dashboard.handle_changes(dashboard.view.monitor.handle_sample(sample), now_s)
        if isinstance(sample, SceneSample):
            scene_s = now_s
            if not streams.is_open and opening.includes(sample, dashboard.view.generation()):
                dashboard.draw(streams, now_s)
                streams.open()
    if now_s > 0.0:
        dashboard.draw(streams, now_s)
    if not streams.is_open:
        streams.open()
