"""The results of the thesis, one file each, each reproducible by one command."""
