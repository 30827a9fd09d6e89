"""Of too much data about the wanted rate is kept, evenly over time and over its sources."""

import itertools

import pytest

from crcolony.recordings.downsampling import Downsampler

RATE = 100_000
START_MS = 1_790_000_000_000


def kept(sources: int, size: int, seconds: int) -> list[tuple[int, int]]:
    """Offer ten items a second from each source; return times and sources of those that are kept."""
    downsampler = Downsampler(RATE)
    return [
        (unix_ms, source)
        for tenth in range(10 * seconds)
        for source in range(sources)
        if downsampler.should_keep(size, unix_ms := START_MS + 100 * tenth + source)
    ]


def test_a_rate_below_the_limit_is_kept_whole() -> None:
    """Every item."""
    assert len(kept(1, 1_000, 10)) == 100


@pytest.mark.parametrize(("sources", "size"), [(1, 100_000), (1, 12_000), (3, 40_000)])
def test_a_rate_above_the_limit_is_reduced_to_it_evenly(sources: int, size: int) -> None:
    """Over time, and over the sources."""
    seconds = 40
    items = kept(sources, size, seconds)
    assert len(items) * size == pytest.approx(RATE * seconds, rel=0.25)
    for source in range(sources):
        times = [unix_ms for unix_ms, one in items if one == source]
        share = len(items) / sources
        assert len(times) == pytest.approx(share, rel=0.3)
        gaps_s = [(b - a) / 1000.0 for a, b in itertools.pairwise(times)]
        assert max(gaps_s) < 4.0 * seconds / share


def test_after_a_pause_everything_is_kept_again() -> None:
    """Up to the limit of a second."""
    downsampler = Downsampler(RATE)
    for k in range(1_000):
        downsampler.should_keep(10_000, START_MS + k)
    assert all(downsampler.should_keep(10_000, START_MS + 60_000 + k) for k in range(10))
    assert not downsampler.should_keep(10_000, START_MS + 60_500)
