"""Takes the pictures of README and of `docs`: dashboards of colonies of 4, 16, 100 and 1,000 robots.

`python -m tests.system.take_pictures [FOLDER]` evolves the colonies, draws their dashboards (`crcolony replay`), and
writes what Rerun's viewer shows of the last generation to the folders of `PICTURES`, or to FOLDER.
"""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

from crcolony_dashboards.preconditions import check_rerun
from crcolony_dashboards.rerun_streams import ARENA_TIMELINE
from PIL import Image

from tests.support.process import wait_until
from tests.support.process_colony import crcolony
from tests.support.rerun_viewer import HeadlessViewer, headless_viewer_of

TABS = ("colony", "evolution", "genes", "life", "lineage", "network", "log")
COLONIES = {
    4: ["generations=100"],
    16: ["generations=20", "life.agents=10", "life.slices=6"],
    100: ["generations=10", "life.agents=6", "life.slices=3"],
    1_000: ["generations=6", "life.agents=3", "life.slices=2", "life.slice_steps=60"],
}
README, DOCS = Path("dashboards/pictures"), Path("docs/pictures")
PICTURES: dict[int, dict[Path, tuple[str, ...]]] = {
    4: {
        README: ("colony", "evolution", "genes"),
        DOCS: ("life", "lineage", "network", "log"),
    },
    16: {DOCS: ("colony",)},
    100: {DOCS: ("colony",)},
    1_000: {DOCS: ("colony",)},
}
"""The tabs of every colony, by the folder of their pictures"""
SHOWN_S = 30.0
"""Of the colony's time that is drawn of a generation"""
WIDTH_PX = 1600
COLOURS = 128
"""Of a picture's palette"""


def main() -> None:
    """Take all pictures."""
    check_rerun()
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else None
    with tempfile.TemporaryDirectory() as name:
        for robots, settings in COLONIES.items():
            folder = Path(name) / str(robots)
            options = [
                word for setting in (f"robots={robots}", *settings) for word in ("--set", setting)
            ]
            run("evolve", *options, "--out", str(folder))
            run("replay", str(folder), "--seconds", str(SHOWN_S))
            take_pictures(folder, robots, target)


def run(*arguments: str) -> None:
    """Run a command of crcolony."""
    subprocess.run(crcolony(*arguments), check=True, stdout=subprocess.DEVNULL)


def take_pictures(folder: Path, robots: int, target: Path | None) -> None:
    """Take the pictures of a replay, near the end of the stretch that it opens with."""
    with headless_viewer_of(folder / "replay.rrd", folder / "viewer.log") as viewer:
        wait_until(
            lambda: viewer.until_s(ARENA_TIMELINE) > 0.0, "the viewer has loaded the recording"
        )
        shown_s = viewer.until_s(ARENA_TIMELINE) - 0.1 * SHOWN_S
        viewer.client.set_time(ARENA_TIMELINE, duration=shown_s, play_state="paused")
        for place, tabs in PICTURES[robots].items():
            (target or place).mkdir(parents=True, exist_ok=True)
            for tab in tabs:
                take_picture(viewer, tab, (target or place) / f"{tab}-{robots}.png")


def take_picture(viewer: HeadlessViewer, tab: str, file: Path) -> None:
    """Write a picture of a tab."""
    viewer.turn_to(TABS.index(tab))
    time.sleep(3.0)  # the viewer loads the tab
    viewer.whole_picture()
    time.sleep(1.0)
    whole = Image.fromarray(viewer.whole_picture())
    size = (WIDTH_PX, WIDTH_PX * whole.height // whole.width)
    small = whole.resize(size, Image.Resampling.LANCZOS)
    small.quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(
        file, optimize=True
    )
    print(file, file.stat().st_size, flush=True)


if __name__ == "__main__":
    main()
