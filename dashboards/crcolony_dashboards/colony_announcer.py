"""Messages about which colonies are online."""

_OFFLINE_AFTER_S = 2.0
"""A colony that is absent for less than this is still regarded as online"""


class ColonyAnnouncer:
    """Announces colonies that come online, and that none is online."""

    def __init__(self) -> None:
        self._announced: set[str] | None = None
        """The colonies online at the last update; None before the first"""
        self._last_seen_s: dict[str, float] = {}

    def update(self, colonies: set[str], now_s: float) -> list[str]:
        """Return the messages to print, given the colonies that have robots on the network now."""
        self._last_seen_s |= dict.fromkeys(colonies, now_s)
        online = {
            name for name, seen_s in self._last_seen_s.items() if now_s - seen_s < _OFFLINE_AFTER_S
        }
        before, self._announced = self._announced, online
        if online == before:
            return []
        if online:
            return [f"watching {name}" for name in sorted(online - (before or set()))]
        if before is None:
            return ["no colony on the network yet; waiting …"]
        return ["no colony on the network any more; waiting …"]
