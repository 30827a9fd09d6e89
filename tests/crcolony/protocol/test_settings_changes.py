"""What differs between the settings of two runs of an arena is named setting by setting."""

import json

import msgspec
import pytest

from crcolony.protocol.settings_changes import settings_changes


def changes(before: object, after: object) -> list[str]:
    return settings_changes(json.dumps(before), json.dumps(after))


def test_every_setting_that_differs_is_named_with_both_values() -> None:
    """In order, with its group; those that are equal are not."""
    before = {"arena": {"packs": 8, "wall": True, "size_m": 2.0}, "body": {"camera_m": 1.5}}
    after = {"arena": {"packs": 12, "wall": True, "size_m": 3.5}, "body": {"camera_m": 1.5}}
    assert changes(before, after) == ["arena.packs 8 → 12", "arena.size_m 2.0 → 3.5"]
    assert changes(before, before) == []


def test_a_setting_that_only_one_has_is_named() -> None:
    """The two arenas may be of two versions of the program."""
    assert changes({"a": {"old": 1}}, {"a": {"new": [1]}}) == ["a.new none → [1]", "a.old 1 → none"]


def test_a_group_that_only_one_has_is_left_out() -> None:
    """It may not have fitted into the message."""
    assert changes({"a": {"x": 1}}, {"b": {"x": 1}}) == []


def test_long_values_are_cut() -> None:
    """An arena may have many obstacles."""
    (change,) = changes({"a": {"x": 1}}, {"a": {"x": list(range(1000))}})
    assert change.startswith("a.x 1 → [0,1,2")
    assert change.endswith("…")
    assert len(change) < 60


def test_what_is_no_settings_is_refused() -> None:
    """Anyone can publish anything."""
    for text in ("[1]", '{"a": 1}', "noise"):
        with pytest.raises(msgspec.DecodeError):
            settings_changes(text, text)
