"""Telemetry of runs: recorded, re-simulated, or synthesised from a history; exported as tables."""
