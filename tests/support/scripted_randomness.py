"""Randomness that is written down, so that an algorithm can be compared with a table that was worked by hand."""

from collections.abc import Iterable
from typing import Any

import numpy as np


class ScriptedGenerator:
    """A generator, and what begins its events, whose numbers are given: each call takes the next."""

    def __init__(self, numbers: Iterable[Any]) -> None:
        self._numbers = iter(numbers)

    def begin(self, stream: Any) -> "ScriptedGenerator":
        return self

    def _next(self, *shape: Any, size: Any = None) -> Any:
        value = next(self._numbers)
        return np.asarray(value) if isinstance(value, list) else value

    def integers(self, high: int, size: Any = None) -> Any:
        return self._next()

    def random(self, size: Any = None) -> Any:
        return self._next()

    def standard_normal(self, size: Any = None) -> Any:
        return self._next()

    def is_used_up(self) -> bool:
        return next(self._numbers, None) is None
