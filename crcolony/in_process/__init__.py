"""An arena and its robots in one process, as fast as possible."""
