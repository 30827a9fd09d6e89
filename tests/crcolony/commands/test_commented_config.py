"""A config as TOML says of every setting what it means, its unit and its range."""

from typing import Any

import msgspec
import pytest

from crcolony.commands.commented_config import commented_toml, format_range, meanings, unit_of
from crcolony.config import Config, ConfigError, is_group, load, setting_types

GROUPS = [Config, *(kind for _, kind in setting_types() if is_group(kind))]


@pytest.mark.parametrize("group", GROUPS, ids=lambda group: group.__name__)
def test_every_setting_has_a_meaning(group: type[msgspec.Struct]) -> None:
    """A sentence below it, where it is declared."""
    texts = meanings(group)
    for field in msgspec.structs.fields(group):
        if not is_group(field.type):
            assert texts[field.name].endswith("."), field.name


def test_a_comment_has_meaning_unit_and_range() -> None:
    """In brackets behind the meaning; every line is ASCII, so that any terminal and editor keeps it."""
    lines = commented_toml(Config()).splitlines()
    place = lines.index("camera_range_m = 1.5")
    assert lines[place - 1] == "# How far the camera sees. [m, above 0.0 to 10000.0]"
    assert "[body.noise]" in lines
    assert all(line.isascii() and len(line) <= 100 for line in lines)


@pytest.mark.parametrize(
    ("name", "unit"),
    [("speed_m_s", "m/s"), ("wall_m", "m"), ("drain_per_s", "1/s"), ("area_m2", "m^2"), ("sd", "")],
)
def test_the_unit_is_the_end_of_a_name(name: str, unit: str) -> None:
    """The longest that fits."""
    assert unit_of(name) == unit


def test_the_printed_ranges_are_those_that_are_checked() -> None:
    """A number just beyond its range is refused, at both ends."""
    checked = 0
    for key, kind in setting_types():
        if is_group(kind):
            continue
        allowed: Any = msgspec.inspect.type_info(kind)
        text = format_range(allowed)
        if isinstance(allowed, msgspec.inspect.IntType | msgspec.inspect.FloatType):
            low, high = text.removeprefix("above ").split(" to ")
            below = float(low) - (0.0 if text.startswith("above") else 1.0)
            for value in (below, 2.0 * float(high) + 1.0):
                number = int(value) if isinstance(allowed, msgspec.inspect.IntType) else value
                with pytest.raises(ConfigError, match=key):
                    load(None, [f"{key}={number}"])
                checked += 1
    assert checked > 100
