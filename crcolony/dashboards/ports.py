"""Where viewers find a dashboard, as Rerun has it; no imports, so that `--help` answers at once."""

LIVE_PORT = 9876
WEB_PORT = 9090
