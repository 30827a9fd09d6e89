"""A stream is two numbers, and draws the numbers of SplitMix64."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crcolony.randomness import (
    EventGenerator,
    draw,
    draw_bits,
    draw_bits_uncompiled,
    draw_uncompiled,
    generator,
    new_streams,
)

UINT64 = st.integers(0, 2**64 - 1)


@given(UINT64, st.integers(0, 2**40))
def test_bits_are_those_of_splitmix64(key: int, counter: int) -> None:
    """As printed by its authors, with integers modulo 2^64."""
    stream = np.array([key, counter], dtype=np.uint64)
    mask = 2**64 - 1
    for k in range(1, 4):
        z = (key + (counter + k) * 0x9E3779B97F4A7C15) & mask
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & mask
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & mask
        assert int(draw_bits(stream)) == z ^ (z >> 31)
    assert stream.tolist() == [key, counter + 3]


def test_the_published_first_numbers_of_seed_zero() -> None:
    """The test vector that every implementation shares."""
    stream = np.zeros(2, dtype=np.uint64)
    drawn = [int(draw_bits(stream)) for _ in range(3)]
    assert drawn == [0xE220A8397B1DCDAF, 0x6E789E6AA1B965F4, 0x06C45D188009454F]


@given(UINT64)
def test_draws_lie_in_zero_to_one(key: int) -> None:
    """1 is not drawn."""
    stream = np.array([key, 0], dtype=np.uint64)
    for _ in range(20):
        assert 0.0 <= draw(stream) < 1.0


def test_draws_are_uniform() -> None:
    """Chi square over 100 bins (99 degrees, 99.99 %), and neighbours are uncorrelated."""
    stream = new_streams(5, (0,), 1)[0]
    drawn = np.array([draw(stream) for _ in range(50_000)])
    counts = np.bincount((drawn * 100).astype(int), minlength=100)
    assert ((counts - 500) ** 2 / 500).sum() < 161.0
    assert abs(np.corrcoef(drawn[1:], drawn[:-1])[0, 1]) < 0.02


def test_streams_differ_by_seed_purpose_and_index() -> None:
    """They are the same for the same three."""
    assert np.array_equal(new_streams(1, (0,), 3), new_streams(1, (0,), 3))
    every = [new_streams(seed, (purpose,), 50)[:, 0] for seed in (1, 2) for purpose in (0, 1)]
    assert np.unique(np.concatenate(every)).size == 200


def test_a_copied_stream_draws_the_same_numbers() -> None:
    """Its state is its two numbers; a generator for a rare event uses one draw."""
    stream = new_streams(1, (0,), 1)[0]
    draw(stream)
    copy = stream.copy()
    assert draw(stream) == draw(copy)
    assert generator(stream).random() == generator(copy).random()
    assert stream.tolist() == copy.tolist()
    assert generator(stream).random() != pytest.approx(generator(stream).random())


@given(UINT64)
def test_a_generator_is_philox_with_a_draw_as_its_key(key: int) -> None:
    """Whatever it draws, and has drawn for the events before."""
    stream = np.array([key, 0], dtype=np.uint64)
    copy, events = stream.copy(), EventGenerator()
    for _ in range(3):
        own = events.begin(stream)
        numpys = np.random.Generator(np.random.Philox(key=draw_bits_uncompiled(copy)))
        for rng in (own, numpys):
            rng.integers(7, dtype=np.uint32)  # which leaves half of a number behind
        assert own.random() == numpys.random()
        assert own.normal(size=9).tolist() == numpys.normal(size=9).tolist()


def test_uncompiled_draws_are_the_same_numbers() -> None:
    """In any order of the two ways, and beyond the largest counter."""
    one = new_streams(7, (1,), 1)[0]
    one[1] = 2**64 - 3
    other = one.copy()
    for _ in range(6):
        assert draw_bits_uncompiled(one) == int(draw_bits(other))
        assert draw_uncompiled(other) == draw(one)
        assert one.tolist() == other.tolist()
