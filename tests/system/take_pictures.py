"""Takes the pictures of `dashboards/README.md`: every tab with 4, 100 and 1,000 robots.

`python -m tests.system.take_pictures [FOLDER]` evolves three colonies, draws their dashboards (`crcolony replay`), and
writes what Rerun's viewer shows of the last generation to `dashboards/pictures`, or to FOLDER.
"""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

from crcolony_dashboards.preconditions import check_rerun
from PIL import Image

from crcolony.config import load
from tests.support.process_colony import crcolony
from tests.support.rerun_viewer import headless_viewer_of

TABS = ("arena", "life", "evolution", "lineage", "network", "log")
COLONIES = {
    4: ["generations=250"],
    100: ["generations=30", "life.agents=10", "life.slice_steps=150"],
    1_000: ["generations=6", "life.agents=6", "life.slice_steps=100", "life.slices=2"],
}
SHOWN_S = 60.0
"""Of the colony's time that is drawn of a generation"""
WIDTH_PX = 640
COLOURS = 96
"""Of a picture's palette"""


def main() -> None:
    """Take all pictures."""
    check_rerun()
    target = Path(sys.argv[1] if len(sys.argv) > 1 else "dashboards/pictures")
    target.mkdir(parents=True, exist_ok=True)
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


def take_pictures(folder: Path, robots: int, target: Path) -> None:
    """Take a picture of every tab of a replay, at a time at which the arena of the last generation is drawn."""
    with headless_viewer_of(folder / "replay.rrd", folder / "viewer.log") as viewer:
        viewer.client.set_time("sim", duration=shown_at_s(folder), play_state="paused")
        for number, tab in enumerate(TABS):
            viewer.turn_to(number)
            time.sleep(1.5)  # the viewer loads the tab
            viewer.whole_picture()
            small = Image.fromarray(viewer.whole_picture())
            small = small.resize(
                (WIDTH_PX, WIDTH_PX * small.height // small.width), Image.Resampling.LANCZOS
            )
            file = target / f"{tab}-{robots}.png"
            small.quantize(COLOURS, dither=Image.Dither.NONE).save(file, optimize=True)
            print(file, file.stat().st_size, flush=True)


def shown_at_s(folder: Path) -> float:
    """Return a time of the colony at which a replay shows the last generation."""
    config = load(folder / "config.toml")
    life = config.life
    steps = (config.generations - 1) * life.agents * life.slices * life.slice_steps
    return steps * config.arena.control_period_s + 0.75 * SHOWN_S


if __name__ == "__main__":
    main()
