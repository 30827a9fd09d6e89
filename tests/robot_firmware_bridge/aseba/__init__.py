"""Robots that run Aseba: their protocol, their program, and the driver on a simulator that others wrote."""
