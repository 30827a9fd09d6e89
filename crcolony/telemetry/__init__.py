"""The receiving side of telemetry: samples of robots and arenas, and the state of colonies that follows from them."""
