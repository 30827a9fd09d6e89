"""A robot learns which settings of its arena have changed when the arena is restarted."""

import pytest

from crcolony.nodes.arena_changes import ArenaChanges
from crcolony.protocol.codec import WireError, encode
from crcolony.protocol.telemetry_messages import ArenaMetadata


def metadata(arena_run: int, packs: int) -> bytes:
    return encode(ArenaMetadata("lab", arena_run, f'{{"arena":{{"packs":{packs}}}}}'))


def test_a_new_run_with_other_settings_is_named_once() -> None:
    """The first run has nothing to be compared with."""
    changes = ArenaChanges()
    assert changes.handle_metadata(metadata(1, 8), 1) is None
    line = "arena lab has other settings than before: arena.packs 8 → 12"
    assert changes.handle_metadata(metadata(2, 12), 2) == line
    assert changes.handle_metadata(metadata(2, 12), 2) is None


def test_a_new_run_with_the_same_settings_is_not() -> None:
    """Nothing has changed for the robot."""
    changes = ArenaChanges()
    changes.handle_metadata(metadata(1, 8), 1)
    assert changes.handle_metadata(metadata(2, 8), 2) is None


def test_a_reply_of_another_run_is_ignored() -> None:
    """A robot has its body in one run."""
    changes = ArenaChanges()
    changes.handle_metadata(metadata(1, 8), 1)
    assert changes.handle_metadata(metadata(3, 99), 2) is None
    assert changes.handle_metadata(metadata(2, 12), 2) is not None


@pytest.mark.parametrize("data", [b"noise", encode(ArenaMetadata("lab", 1, "noise"))])
def test_a_malformed_reply_is_refused(data: bytes) -> None:
    """Of the message, and of the settings in it."""
    with pytest.raises(WireError):
        ArenaChanges().handle_metadata(data, 1)
