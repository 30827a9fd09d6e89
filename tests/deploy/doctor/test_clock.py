"""A clock that differs from those of most others is wrong, and how far is said."""

from pathlib import Path

import pytest
from crcolony_deploy.doctor.clock import check_clock
from crcolony_deploy.doctor.colony_view import ColonyView

from tests.support.examined_hosts import ADA, BOB, answer, host_of, lines

ROBOTS = (b"c" * 16, b"d" * 16)


@pytest.mark.parametrize(
    ("offset_s", "found"),
    [
        (0.3, "ok: the clock agrees with those of 3 robots elsewhere"),
        (-5.0, "warning: this clock is 5 s ahead of those of 3 robots elsewhere"),
        (3600.0, "problem: this clock is 3600 s behind those of 3 robots elsewhere"),
    ],
)
def test_the_clock_is_compared_with_those_of_most_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, offset_s: float, found: str
) -> None:
    """One other host whose clock is wrong changes nothing, nor do the robots of this host."""
    answer(monkeypatch, tmp_path, "timedatectl", "yes")
    offsets_s = {ADA: 0.0, BOB: 90_000.0} | dict.fromkeys(ROBOTS, offset_s)
    host = host_of(tmp_path, colony=ColonyView(clock_offsets_s=offsets_s), own={"ada": ADA})
    assert lines(check_clock(host)) == [found]


def test_a_clock_that_nobody_sets_is_a_warning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It drifts."""
    answer(monkeypatch, tmp_path, "timedatectl", "no")
    assert lines(check_clock(host_of(tmp_path))) == ["warning: the clock is not synchronised"]
