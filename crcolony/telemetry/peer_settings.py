"""Reads the settings in the metadata of robots and arenas; invalid settings count as none."""

from typing import TypeVar

import msgspec

from crcolony.body.settings import CyberRodent
from crcolony.protocol.telemetry_messages import ArenaMetadata, RobotMetadata
from crcolony.robot.settings import Heredity, Learning, Life

_MAX_CACHED = 1_000
"""Texts of settings whose values are kept."""


class Mind(msgspec.Struct, frozen=True):
    """The settings by which a robot's genes are read."""

    body: CyberRodent
    learning: Learning
    heredity: Heredity


class _BodySettings(msgspec.Struct, frozen=True):
    body: CyberRodent


class _LifeSettings(msgspec.Struct, frozen=True):
    life: Life


Kind = TypeVar("Kind")


class PeerSettings:
    """Decodes settings, and caches them by their text."""

    def __init__(self) -> None:
        self._cache: dict[tuple[object, str], object] = {}

    def of_robot(self, metadata: RobotMetadata | None) -> Mind | None:
        """Return the settings by which a robot's genes are read, or None if they are unknown or invalid."""
        return self._decode(Mind, metadata.settings) if metadata is not None else None

    def life_of(self, metadata: RobotMetadata | None) -> Life | None:
        """Return the settings of a robot's lifetimes, or None if they are unknown or invalid."""
        settings = self._decode(_LifeSettings, metadata.settings) if metadata is not None else None
        return settings.life if settings is not None else None

    def of_arena(self, metadata: ArenaMetadata | None) -> CyberRodent | None:
        """Return the settings of the bodies in an arena, or None if they are unknown or invalid."""
        settings = self._decode(_BodySettings, metadata.settings) if metadata is not None else None
        return settings.body if settings is not None else None

    def _decode(self, kind: type[Kind], text: str) -> Kind | None:
        key = (kind, text)
        if key not in self._cache:
            if len(self._cache) > _MAX_CACHED:
                self._cache.clear()
            try:
                self._cache[key] = msgspec.json.decode(text, type=kind)
            except msgspec.DecodeError:
                self._cache[key] = None
        settings = self._cache[key]
        return settings if isinstance(settings, kind) else None
