"""Robots whose controller runs MicroPython: a script is uploaded that speaks as the reference firmware does."""
