"""Robots with StandardFirmata."""
