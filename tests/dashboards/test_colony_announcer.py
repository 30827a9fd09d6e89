"""A dashboard prints once which colonies are online."""

from crcolony_dashboards.colony_announcer import ColonyAnnouncer

NONE_YET = "no colony on the network yet; waiting …"
NONE_NOW = "no colony on the network any more; waiting …"


def test_colonies_are_announced_once() -> None:
    """Each by its name; before the first one, that there is none."""
    announcer = ColonyAnnouncer()
    assert announcer.update(set(), 0.0) == [NONE_YET]
    assert announcer.update(set(), 1.0) == []
    assert announcer.update({"red", "blue"}, 2.0) == ["watching blue", "watching red"]
    assert announcer.update({"red", "blue"}, 3.0) == []


def test_a_short_absence_is_not_announced() -> None:
    """Only after two seconds without a colony."""
    announcer = ColonyAnnouncer()
    assert announcer.update({"blue"}, 0.0) == ["watching blue"]
    assert announcer.update(set(), 1.0) == []
    assert announcer.update({"blue"}, 1.5) == []
    assert announcer.update(set(), 3.6) == [NONE_NOW]
    assert announcer.update(set(), 9.0) == []
    assert announcer.update({"blue"}, 10.0) == ["watching blue"]
