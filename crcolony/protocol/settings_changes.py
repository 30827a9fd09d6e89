"""What differs between the settings that an arena reported in one run and in the next."""

from collections.abc import Iterator
from typing import Any

import msgspec

_MAX_VALUE_CHARACTERS = 40
"""Longer values are cut: an arena may have many obstacles."""

_decode = msgspec.json.Decoder(dict[str, dict[str, Any]]).decode


def settings_changes(before: str, after: str) -> list[str]:
    """Return a text for every setting that differs between two JSON objects of groups, `group.name old → new`.

    A group that only one of them has is left out, as it may not have fitted into the message. Raises
    msgspec.DecodeError if a text is no such object.
    """
    old, new = _decode(before), _decode(after)
    return [
        change
        for group in old
        if group in new
        for change in _changes_of_group(group, old[group], new[group])
    ]


def _changes_of_group(group: str, old: dict[str, Any], new: dict[str, Any]) -> Iterator[str]:
    for name in sorted(old.keys() | new.keys()):
        if old.get(name) != new.get(name):
            yield f"{group}.{name} {_format(old.get(name))} → {_format(new.get(name))}"


def _format(value: Any) -> str:
    text = msgspec.json.encode(value).decode() if value is not None else "none"
    is_long = len(text) > _MAX_VALUE_CHARACTERS
    return f"{text[: _MAX_VALUE_CHARACTERS - 1]}…" if is_long else text
