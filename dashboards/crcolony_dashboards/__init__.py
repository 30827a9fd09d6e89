"""Watching colonies in Rerun: live (`live.py`), and again from what was recorded (`replay.py`)."""
