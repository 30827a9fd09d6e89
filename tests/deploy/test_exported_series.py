"""Series are bounded: whoever comes online first has a place and keeps it, and what has none is counted."""

from crcolony_deploy.exported_series import KEEP_ABSENT_S, ExportedSeries

from crcolony.protocol.identity import RobotId
from tests.support.fed_monitor import IDS, ME, PEER, T


def short(robot: RobotId) -> str:
    return robot.hex()[:8]


def test_no_more_robots_than_the_maximum_have_series() -> None:
    """However many names a peer makes up: those beyond it are counted and make no series."""
    series = ExportedSeries[RobotId](3, short)
    series.update(IDS[:2], T)
    series.update(IDS[:50], T + 1.0)
    assert set(series.labels) == set(IDS[:3])
    assert series.omitted == set(IDS[3:50])


def test_one_that_goes_offline_keeps_its_place_for_a_day() -> None:
    """So a peer that renames itself makes no more series in a day than there are places."""
    series = ExportedSeries[RobotId](2, short)
    series.update(IDS[:2], T)
    series.update([ME, IDS[7]], T + KEEP_ABSENT_S - 1.0)
    assert set(series.labels) == set(IDS[:2])
    series.update([ME, IDS[7]], T + KEEP_ABSENT_S)
    assert set(series.labels) == {ME, IDS[7]}


def test_expected_robots_have_series_before_they_come_online_and_others_never() -> None:
    """One that is missing from the start is an alert, and a stranger is not."""
    series = ExportedSeries[RobotId](1_000, short, [ME])
    assert series.labels == {ME: ME.hex()[:8]}
    series.update([PEER], T)
    assert set(series.labels) == {ME}
    assert series.omitted == {PEER}


def test_two_robots_whose_ids_begin_alike_have_two_labels() -> None:
    """Of the second the label is its whole id: two series of one name would make the whole output unreadable."""
    alike = ME[:4] + bytes(12)
    series = ExportedSeries[RobotId](10, short)
    series.update([ME, alike], T)
    assert series.labels == {ME: ME.hex()[:8], alike: alike.hex()}
