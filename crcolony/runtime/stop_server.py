"""The emergency stop of an arena or a bridge: all bodies at once, latched, released only by who knows the latch."""

import secrets
import threading
from collections import OrderedDict
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Protocol

from crcolony.protocol.codec import WireError, encode
from crcolony.protocol.stop_messages import (
    MAX_ATTACHED,
    Clear,
    Stop,
    StopAddress,
    StoppedRobot,
    StopReply,
    decode_stop,
)

_LATCHES = range(100_000, 1_000_000)
"""Numbers that a person can type; a stop has another one than those before, most of the time."""
_MAX_STOPS = 10_000
"""Stops whose ids are remembered."""


class Stoppable(Protocol):
    """A robot, or several bodies that are stopped as one."""

    @property
    def name(self) -> str:
        """What a person calls it."""
        ...

    @property
    def count(self) -> int:
        """How many bodies it is."""
        ...

    def hold(self) -> bool:
        """Stop it, and let it move no more; return whether that is confirmed. Any thread may call it."""
        ...

    def release(self) -> bool:
        """Let it move again; return whether that is confirmed. Any thread may call it."""
        ...

    def why_not(self) -> str:
        """Return why it is out of reach, "" if it is not."""
        ...


class StopServer:
    """Answers stops and clears of the bodies of an arena or bridge."""

    def __init__(self, bodies: Sequence[Stoppable], print_line: Callable[[str], None]) -> None:
        self._bodies, self._print_line = list(bodies), print_line
        self._latch = 0
        self._stops: OrderedDict[bytes, None] = OrderedDict()
        """Ids of stops that were carried out"""
        self._mutex = threading.Lock()

    def answer(
        self, message: bytes, address: StopAddress, others: Sequence[StopAddress]
    ) -> bytes | None:
        """Carry out a message and return the reply, None if it is malformed. Any thread may call it.

        `address` is that of the arena or bridge, and `others` are the arenas and bridges that are there, too.
        """
        try:
            request = decode_stop(message)
        except WireError:
            return None
        match request:
            case Clear(latch=latch):
                robots = self._clear(latch)
            case Stop(id=stop):
                robots = self._stop(stop)
        return encode(StopReply(address, self._latch, robots[:MAX_ATTACHED], list(others)))

    def _stop(self, stop: bytes) -> list[StoppedRobot]:
        with self._mutex:
            is_held = self._latch != 0
            is_replayed = stop in self._stops and not is_held
            if not is_replayed:
                self._latch = self._latch or secrets.choice(_LATCHES)
                self._stops[stop] = None
                if len(self._stops) > _MAX_STOPS:
                    self._stops.popitem(last=False)
        if is_replayed:
            return self._report([False] * len(self._bodies), "this stop was released: a replay")
        if not is_held:
            self._print_line(
                f"EMERGENCY STOP: nothing moves until crcolony estop --clear {self._latch}"
            )
        return self._report(self._ask_all(lambda body: body.hold()), "not confirmed")

    def _clear(self, latch: int) -> list[StoppedRobot]:
        with self._mutex:
            is_right = latch == self._latch != 0
        if not is_right:
            return self._report([False] * len(self._bodies), "held by another stop, or by none")
        confirmed = self._ask_all(lambda body: body.release())
        self._print_line(f"{sum(confirmed)} of {len(confirmed)} are released")
        with self._mutex:
            if all(confirmed) and self._latch == latch:
                self._latch = 0
        return self._report(confirmed, "not confirmed")

    def _ask_all(self, ask: Callable[[Stoppable], bool]) -> list[bool]:
        """Ask all at once, and return who has confirmed."""
        with ThreadPoolExecutor(max(len(self._bodies), 1)) as pool:
            return list(pool.map(ask, self._bodies))

    def _report(self, confirmed: Sequence[bool], otherwise: str) -> list[StoppedRobot]:
        return [
            StoppedRobot(
                body.name[:100],
                body.count,
                done,
                "" if done else (body.why_not() or otherwise)[:200],
            )
            for body, done in zip(self._bodies, confirmed, strict=True)
        ]
