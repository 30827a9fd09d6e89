"""Whole colonies in virtual time, in one thread, with everything going wrong by seed: `colony.simulate`."""
