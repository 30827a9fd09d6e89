"""The thesis' results, one file each, reproducible by one command."""
