"""Robots with StandardFirmata, as on many an Arduino. Nothing stops their wheels when this machine is gone."""
