"""What a spectator makes of what is heard: no I/O, no clock, and nothing of Rerun."""
