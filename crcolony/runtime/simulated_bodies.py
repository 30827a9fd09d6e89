"""The simulated bodies of an arena, as an emergency stop sees them: all of them stop as one."""

import time

from crcolony.nodes.arena_node import ArenaNode

_STEP_WAIT_S = 0.2
_POLL_S = 0.01


class SimulatedBodies:
    """Holds and releases all bodies of an arena. Any thread may call its methods."""

    def __init__(self, node: ArenaNode) -> None:
        self._node = node

    @property
    def name(self) -> str:
        """What a person calls them."""
        return "simulated bodies"

    @property
    def count(self) -> int:
        """How many there are."""
        return len(self._node.robots)

    def hold(self) -> bool:
        """Turn no wheel from the next tick on; return when that has come, or no tick comes: then nothing moves."""
        self._node.is_held = True
        tick, end_s = self._node.tick, time.monotonic() + _STEP_WAIT_S
        while self._node.tick <= tick + 1 and time.monotonic() < end_s:
            time.sleep(_POLL_S)
        return True

    def release(self) -> bool:
        """Let wheels turn again."""
        self._node.is_held = False
        return True

    def why_not(self) -> str:
        """They are never out of reach."""
        return ""
