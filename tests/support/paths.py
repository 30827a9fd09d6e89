"""Where the checkout is, for tests that read its documents or run its commands."""

import os
from pathlib import Path

ROOT = Path(__file__).parents[2]

PYTHONPATH = os.pathsep.join(
    str(ROOT / folder) for folder in (".", "dashboards", "deploy", "robot_firmware_bridge")
)
"""For processes that tests start: they run the code of this checkout, whatever is installed."""
