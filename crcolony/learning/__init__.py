"""Learning in a lifetime: chapters 2 and 3 of the thesis, one algorithm a file."""
