"""A live dashboard never overwrites a recording."""

from pathlib import Path

from crcolony_dashboards.live import unused_path


def test_no_recording_is_overwritten(tmp_path: Path) -> None:
    """The next one has the next number."""
    rrd = tmp_path / "dashboard.rrd"
    for name in ("dashboard.rrd", "dashboard-2.rrd", "dashboard-3.rrd"):
        free = unused_path(rrd)
        assert free.name == name
        free.touch()
