"""Dashboards of colonies in Rerun: live (`live.py`), and of recorded or re-simulated runs (`replay.py`)."""
