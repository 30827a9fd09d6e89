"""What a live dashboard says of who is there, and where it records."""

from pathlib import Path

from crcolony_dashboards.live import ColonyAnnouncer, free_name

LOOKING, GONE = "no colony on the network yet; looking …", "nobody is there any more; looking …"


def test_it_says_once_that_nobody_is_there_and_then_who_comes() -> None:
    """Each colony by its name."""
    presence = ColonyAnnouncer()
    assert presence.changes(set(), 0.0) == [LOOKING]
    assert presence.changes(set(), 1.0) == []
    assert presence.changes({"red", "blue"}, 2.0) == ["watching blue", "watching red"]
    assert presence.changes({"red", "blue"}, 3.0) == []


def test_who_is_gone_for_a_moment_was_always_there() -> None:
    """Only after two seconds without anybody it looks again."""
    presence = ColonyAnnouncer()
    assert presence.changes({"blue"}, 0.0) == ["watching blue"]
    assert presence.changes(set(), 1.0) == []
    assert presence.changes({"blue"}, 1.5) == []
    assert presence.changes(set(), 3.6) == [GONE]
    assert presence.changes(set(), 9.0) == []
    assert presence.changes({"blue"}, 10.0) == ["watching blue"]


def test_no_film_is_written_over(tmp_path: Path) -> None:
    """The next one has the next number."""
    rrd = tmp_path / "dashboard.rrd"
    for name in ("dashboard.rrd", "dashboard-2.rrd", "dashboard-3.rrd"):
        free = free_name(rrd)
        assert free.name == name
        free.touch()
