"""One small counter-based generator whose whole state is two numbers (Steele, Lea and Flood 2014:
SplitMix64).

A stream is an array `[key, counter]` of uint64. Drawing increments the counter and mixes `key +
counter * golden`, so that a stream can be saved, restored and copied as data, and gives the same
numbers in a batch of 1 and of N. Rare events (an offspring, the next agent) use a
`numpy.random.Generator` seeded by one draw.
"""

import numpy as np
from numpy.typing import NDArray

from crcolony.compiled import compiled

Stream = NDArray[np.uint64]

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
_MIX_2 = np.uint64(0x94D049BB133111EB)
_SHIFT_30 = np.uint64(30)
_SHIFT_27 = np.uint64(27)
_SHIFT_31 = np.uint64(31)
_SHIFT_11 = np.uint64(11)
_ONE = np.uint64(1)
_UNIT = 1.0 / 9007199254740992.0


def new_streams(seed: int, names: tuple[int, ...], count: int) -> NDArray[np.uint64]:
    """Return `count` independent streams, shape (count, 2), for the purpose `names` under one root
    seed."""
    keys = np.random.SeedSequence(seed, spawn_key=names).generate_state(count, np.uint64)
    streams = np.zeros((count, 2), dtype=np.uint64)
    streams[:, 0] = keys
    return streams


@compiled
def draw_bits(stream: Stream) -> np.uint64:
    """Draw 64 random bits."""
    stream[1] += _ONE
    bits = stream[0] + stream[1] * _GOLDEN
    bits = (bits ^ (bits >> _SHIFT_30)) * _MIX_1
    bits = (bits ^ (bits >> _SHIFT_27)) * _MIX_2
    mixed: np.uint64 = bits ^ (bits >> _SHIFT_31)
    return mixed


@compiled
def draw(stream: Stream) -> float:
    """Draw a number uniform in [0, 1)."""
    return np.float64(draw_bits(stream) >> _SHIFT_11) * _UNIT


def draw_bits_uncompiled(stream: Stream) -> int:
    """Draw the same 64 bits as `draw_bits`, in plain Python: a rare event needs no compiler."""
    word = (1 << 64) - 1
    counter = (int(stream[1]) + 1) & word
    stream[1] = counter
    bits = (int(stream[0]) + counter * int(_GOLDEN)) & word
    bits = ((bits ^ (bits >> 30)) * int(_MIX_1)) & word
    bits = ((bits ^ (bits >> 27)) * int(_MIX_2)) & word
    return bits ^ (bits >> 31)


def draw_uncompiled(stream: Stream) -> float:
    """Draw the same number in [0, 1) as `draw`, in plain Python."""
    return (draw_bits_uncompiled(stream) >> 11) * _UNIT


class EventGenerator:
    """Numpy's generator for one rare event after another, each seeded by one draw of a stream.

    It draws the numbers of a new `Philox(key=draw)`, which would take fifteen times as long to make. An event is over
    when the next one begins.
    """

    def __init__(self) -> None:
        self._bits = np.random.Philox(0)
        self._rng = np.random.Generator(self._bits)
        self._state = self._bits.state
        self._state["state"]["key"][:] = 0

    def begin(self, stream: Stream) -> np.random.Generator:
        """Return the generator for the next event, at the begin of its numbers."""
        self._state["state"]["key"][0] = draw_bits_uncompiled(stream)
        self._bits.state = self._state
        return self._rng


def generator(stream: Stream) -> np.random.Generator:
    """Return a generator of its own for one rare event, seeded by one draw of the stream."""
    return EventGenerator().begin(stream)
