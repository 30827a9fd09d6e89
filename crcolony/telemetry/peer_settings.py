"""What robots and arenas say of their settings, read once; nothing of them where they say nonsense."""

from typing import TypeVar

import msgspec

from crcolony.body.settings import CyberRodent
from crcolony.protocol.telemetry_messages import ArenaMetadata, RobotMetadata
from crcolony.robot.settings import Heredity, Learning


class Mind(msgspec.Struct, frozen=True):
    """What decides how a robot's genes are read."""

    body: CyberRodent
    learning: Learning
    heredity: Heredity


class _Nature(msgspec.Struct, frozen=True):
    body: CyberRodent


Kind = TypeVar("Kind")


class PeerSettings:
    """Reads settings, and remembers what it has read."""

    def __init__(self) -> None:
        self._read: dict[tuple[object, str], object] = {}

    def of_robot(self, about: RobotMetadata | None) -> Mind | None:
        """Return what decides how a robot's genes are read."""
        return self._of(Mind, about.settings) if about is not None else None

    def of_arena(self, about: ArenaMetadata | None) -> CyberRodent | None:
        """Return the bodies of an arena."""
        nature = self._of(_Nature, about.settings) if about is not None else None
        return nature.body if nature is not None else None

    def _of(self, kind: type[Kind], text: str) -> Kind | None:
        key = (kind, text)
        if key not in self._read:
            if len(self._read) > 1_000:
                self._read.clear()
            try:
                self._read[key] = msgspec.json.decode(text, type=kind)
            except msgspec.DecodeError:
                self._read[key] = None
        found = self._read[key]
        return found if isinstance(found, kind) else None
