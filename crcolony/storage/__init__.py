"""What stays on disk: one SQLite file for each robot, checkpoints, and the layout of folders."""
