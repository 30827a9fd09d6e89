"""`crcolony launch --dashboard` shows the colony in a browser."""

from pathlib import Path

import numpy as np
import pytest
from crcolony_dashboards.tabs import palette
from numpy.typing import NDArray

from tests.support.browser import CHROMIUM, browser_at, picture_of
from tests.support.process import wait_until
from tests.support.process_colony import colony, settings


@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here")
def test_launch_shows_its_colony_in_a_browser(tmp_path: Path) -> None:
    """At the printed address walls, packs and robots' faces are visible; the recordings are in the run's folder."""
    with colony(tmp_path) as made:
        launched = made.start(
            "launch", "launch", "-n", "4", "--hz", "10", *settings("arena.area_per_robot_m2=0.6"),
            "--listen", made.endpoint, "--dashboard", "--out", str(tmp_path / "run"),
        )  # fmt: skip
        launched.wait_for("dashboard: http://")
        _, _, after = launched.output.partition("dashboard: ")
        with browser_at(after.split()[0]) as page:

            def shows_all() -> bool:
                picture = picture_of(page)
                faces = any(_shows(picture, colour) for colour in palette.MODULES)
                return faces and _shows(picture, palette.DIM) and _shows(picture, palette.PACK)

            wait_until(shows_all, "the browser shows the arena", 120.0)
        launched.stop()
        for file in ("dashboard.rrd", "telemetry.sqlite"):
            assert (tmp_path / "run" / file).stat().st_size > 10_000
        log = (tmp_path / "run" / "logs" / "dashboard.log").read_text()
        assert "Traceback" not in log


def _shows(picture: NDArray[np.uint8], colour: palette.Colour) -> bool:
    is_near = np.abs(picture.astype(int) - colour).sum(axis=-1) < 40
    return int(np.count_nonzero(is_near)) > 60
