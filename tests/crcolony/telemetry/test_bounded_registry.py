"""A registry is bounded: absent entries make room for new ones, and present entries stay."""

import pytest

from crcolony.telemetry.bounded_registry import BoundedRegistry


@pytest.fixture
def removed() -> list[str]:
    return []


@pytest.fixture
def registry(removed: list[str]) -> BoundedRegistry[str, list[int]]:
    return BoundedRegistry(3, removed.append)


def test_an_entry_is_created_once(registry: BoundedRegistry[str, list[int]]) -> None:
    """Later calls return the same one."""
    first = registry.get_or_create("a", 1.0, list)
    assert first is not None
    assert registry.get_or_create("a", 2.0, list) is first
    assert registry.entries == {"a": first}


def test_a_new_entry_evicts_the_absent_one_without_activity_for_longest(
    registry: BoundedRegistry[str, list[int]], removed: list[str]
) -> None:
    """Activity protects, presence more so; where all are present there is no room."""
    for now_s, name in enumerate("abcad"):
        assert registry.get_or_create(name, float(now_s), list) is not None
    assert removed == ["b"]
    for name in "acd":
        registry.mark_present(name)
    assert registry.get_or_create("e", 9.0, list) is None
    registry.mark_absent("c", 10.0)
    assert registry.get_or_create("e", 11.0, list) is not None
    assert removed == ["b", "c"]
    assert set(registry.entries) == {"a", "d", "e"}


def test_absent_entries_are_removed_after_a_time(
    registry: BoundedRegistry[str, list[int]], removed: list[str]
) -> None:
    """Counted from their last activity, or from when they became absent; present ones stay."""
    for name in "abc":
        registry.get_or_create(name, 0.0, list)
    registry.mark_present("a")
    registry.mark_present("b")
    registry.mark_absent("b", 50.0)
    registry.remove_absent_before(50.0)
    assert removed == ["c"]
    registry.remove_absent_before(50.1)
    assert removed == ["c", "b"]
    assert set(registry.entries) == {"a"}
