"""A token bucket limits how many times a second something is done."""

from crcolony.rate_limit import TokenBucket


def test_a_bucket_allows_its_rate() -> None:
    """On average, with at most a second's worth at once; a clock that is set back allows no more."""
    bucket = TokenBucket(10.0)
    assert sum(bucket.allow(100.0) for _ in range(50)) == 10
    assert sum(bucket.allow(100.5) for _ in range(50)) == 5
    assert sum(bucket.allow(0.0) for _ in range(50)) == 0
    assert sum(bucket.allow(101.5) for _ in range(50)) == 10
