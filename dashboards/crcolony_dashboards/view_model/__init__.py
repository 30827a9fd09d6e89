"""What is drawn, computed from telemetry: no I/O, no clock, and no import of Rerun."""
