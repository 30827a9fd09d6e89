"""The dashboard of a run that is over, as a film: what was recorded of it is heard again, or it is lived again."""

import itertools
from collections.abc import Iterable
from pathlib import Path

from crcolony.recordings.resimulation import Windows
from crcolony.recordings.sources import is_recorded, samples_of
from crcolony.telemetry.colony_monitor import ColonyMonitor
from crcolony.telemetry.samples import SceneSample, TelemetrySample
from crcolony_dashboards.dashboard import Dashboard
from crcolony_dashboards.rerun_check import DashboardError, check_rerun
from crcolony_dashboards.rerun_streams import RerunStreams
from crcolony_dashboards.rrd_file import RrdFile, leave, open_film, optimize_rrd
from crcolony_dashboards.throttle import Throttle
from crcolony_dashboards.viewers import open_file

REPLAY = "replay.rrd"
_PERIOD_S, _SILENT_S = 0.1, 2.0
_COARSE_S = 600.0
"""Of the colony's time: how often a run that is lived again is drawn where no arena is shown"""


def run_replay(
    path: Path, out: Path | None, windows: Windows, agent: str = "", native: bool = False
) -> None:
    """Film the dashboard of a folder (or of one recording) into `out`, and open it if that is asked for.

    Raises Refusal: there is nothing to be heard, the film cannot be written, or a run that was lived again came out
    otherwise than its folder says (the film is there then).
    """
    check_rerun()
    target = out or (path if path.is_dir() else path.parent) / REPLAY
    sample = samples_of(path, windows)
    first = next(sample, None)  # what cannot be read at all leaves no film
    if first is None:
        raise DashboardError(f"{path}: nothing was heard")
    dashboard = Dashboard(ColonyMonitor(), agent)
    draft = target.with_name(target.name + ".part")
    rrd = open_film(draft, "replay", dashboard.blueprint("sim", is_live=False))
    trouble: str | None = None
    try:
        coarse_s = _PERIOD_S if is_recorded(path) else _COARSE_S
        play(itertools.chain([first], sample), dashboard, rrd, coarse_s)
    finally:
        trouble = rrd.check()
        rrd.close()
        if trouble is None:
            optimize_rrd(draft)
            draft.replace(target)
            print(target, flush=True)
    if trouble is not None:
        leave(rrd, trouble)
        raise DashboardError(trouble)
    if native:
        open_file(target)


def play(
    sample: Iterable[TelemetrySample], dashboard: Dashboard, rrd: RrdFile, coarse_s: float
) -> None:
    """Draw what is heard as it was heard, ten times a second of its own time; `coarse_s` apart without scenes."""
    streams, fine, coarse = RerunStreams(None, rrd), Throttle(_PERIOD_S), Throttle(coarse_s)
    dashboard.setup(streams)
    now_s = scene_s = 0.0
    for one in sample:
        before_s, now_s = now_s, one.unix_ms / 1000.0
        is_shown = before_s - scene_s < _SILENT_S
        if now_s > before_s > 0.0 and (fine if is_shown else coarse).is_due(before_s):
            dashboard.draw(streams, before_s)
        if isinstance(one, SceneSample):
            scene_s = now_s
        dashboard.handle_changes(dashboard.view.monitor.handle_sample(one), now_s)
    if now_s > 0.0:
        dashboard.draw(streams, now_s)
