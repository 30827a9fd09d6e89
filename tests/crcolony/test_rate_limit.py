"""What strangers ask for is done so often a second, and no more."""

from crcolony.rate_limit import TokenBucket


def test_a_bucket_lets_through_what_it_says() -> None:
    """So many a second on average, at most a second's worth at once, and a clock that is set back takes nothing."""
    bucket = TokenBucket(10.0)
    assert sum(bucket.allow(100.0) for _ in range(50)) == 10
    assert sum(bucket.allow(100.5) for _ in range(50)) == 5
    assert sum(bucket.allow(0.0) for _ in range(50)) == 0
    assert sum(bucket.allow(101.5) for _ in range(50)) == 10
