"""The size of an arena follows from the settings, and what does not fit is refused."""

import msgspec
import pytest

from crcolony.body.settings import CyberRodent
from crcolony.world.arena import Arena
from crcolony.world.arena_size import check_fit, pack_count, size_m
from crcolony.world.settings import ArenaSettings


def test_an_arena_grows_with_the_colony_unless_its_size_is_set() -> None:
    """The number of packs is in proportion, unless it is set."""
    arena = ArenaSettings()
    assert size_m(arena, 4) == pytest.approx((2.2, 2.2))
    assert size_m(arena, 100) == pytest.approx((11.0, 11.0))
    assert pack_count(arena, 4) == 8
    fixed = ArenaSettings(width_m=3.0, height_m=2.0, packs=5)
    assert size_m(fixed, 100) == (3.0, 2.0)
    assert pack_count(fixed, 100) == 5


@pytest.mark.parametrize(
    ("settings", "robots", "message"),
    [
        ({"width_m": 0.3}, 1, "arena.width_m"),
        ({"width_m": 3.0, "height_m": 0.4}, 1, "arena.width_m"),
        ({"width_m": 1.0}, 10, "robots: 10"),
        ({"packs": 2000}, 4, "arena.packs: 2000"),
        ({"pillars": ((0.0, 0.0, 2.0),)}, 4, "arena.pillars"),
    ],
)
def test_what_does_not_fit_is_refused_by_the_name_of_its_setting(
    settings: dict[str, object], robots: int, message: str
) -> None:
    """`Arena` does the same check before it builds anything."""
    arena = msgspec.convert(settings, ArenaSettings)
    with pytest.raises(ValueError, match=message):
        check_fit(arena, CyberRodent(), robots)
    with pytest.raises(ValueError, match=message):
        Arena(robots, arena, CyberRodent(), 1)
