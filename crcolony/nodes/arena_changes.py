"""What a robot knows of its arena's settings: an arena may be another one after a restart, with the same name."""

import msgspec

from crcolony.protocol.codec import WireError
from crcolony.protocol.settings_changes import settings_changes
from crcolony.protocol.telemetry_messages import decode_arena_metadata


class ArenaChanges:
    """Compares the settings of an arena's present run with those of the run before."""

    def __init__(self) -> None:
        self._arena_run: int | None = None
        self._settings = ""

    def handle_metadata(self, data: bytes, arena_run: int) -> str | None:
        """Return what has changed since the run before, as a text; None if nothing has.

        A reply of another run than this is ignored. Raises WireError if the reply is malformed.
        """
        metadata = decode_arena_metadata(data)
        if metadata.arena_run != arena_run or arena_run == self._arena_run:
            return None
        try:
            changes = settings_changes(self._settings or metadata.settings, metadata.settings)
        except msgspec.DecodeError as error:
            raise WireError(f"settings: {error}") from None
        self._arena_run, self._settings = arena_run, metadata.settings
        if not changes:
            return None
        return f"arena {metadata.arena} has other settings than before: {', '.join(changes)}"
