"""Robots with the reference firmware (`firmware/`) on a serial line."""
