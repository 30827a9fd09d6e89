"""Whole colonies in one thread and in virtual time, with faults injected by seed: see `simulate.simulate`."""
