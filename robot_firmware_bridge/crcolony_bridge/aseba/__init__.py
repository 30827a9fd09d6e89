"""Robots that run Aseba: Thymio II and e-puck, over TCP or a serial line."""
