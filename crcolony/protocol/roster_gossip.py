"""How members pass on the newest roster, so that a revocation is everywhere within a second of a connection.

Who is connected to somebody new announces the serial number of its roster. Who has a newer one publishes it; who has an
older one requests it. Every step waits for a random moment, and is left out once another member has made it: many
members do not answer at once. No clock, no network: actions that are due are returned.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

from crcolony.protocol.codec import Message, StrictDecoder, WireError, encode
from crcolony.protocol.roster import Roster, Serial, open_roster
from crcolony.rate_limit import TokenBucket

_ANNOUNCE_DELAY_S = 0.05
_ANSWER_DELAY_S = 0.2
"""An answer waits for a random part of this."""
_PERIOD_S = 1.0
"""The shortest time between two actions of one kind."""
_MAX_VERIFIED_PER_S = 200.0
"""A verification takes 0.1 ms."""


class RosterSerial(Message, frozen=True, tag="roster_serial"):
    """The serial number of the sender's roster: an announcement, or a request for a newer one."""

    serial: Serial


@dataclass(frozen=True)
class Announce:
    """Publish the serial number of the own roster."""

    message: bytes


@dataclass(frozen=True)
class Publish:
    """Publish the own roster."""

    roster: bytes


@dataclass(frozen=True)
class Request:
    """Query others for a newer roster; they reply with `RosterGossip.answer`."""

    message: bytes


Action = Announce | Publish | Request


class RosterGossip:
    """The newest roster that one member knows. `chance` returns random numbers in [0, 1)."""

    def __init__(
        self, signed: bytes, roster: Roster, authority_key: bytes, chance: Callable[[], float]
    ) -> None:
        self.signed, self.roster = signed, roster
        self.is_agreed = False
        """Whether another member has announced that it has the same roster"""
        self._authority_key, self._chance = authority_key, chance
        self._due_s: dict[type[Action], float] = {}
        self._done_s: dict[type[Action], float] = {}
        self._verify_limit = TokenBucket(_MAX_VERIFIED_PER_S)

    def handle_link(self, now_s: float) -> None:
        """Handle that somebody new is connected."""
        self._schedule(Announce, now_s, _ANNOUNCE_DELAY_S)

    def handle_announcement(self, now_s: float, data: bytes) -> None:
        """Handle the serial number of another member's roster; malformed ones are ignored."""
        serial = _serial_in(data)
        if serial is None:
            return
        if serial < self.roster.serial:
            self._schedule(Publish, now_s, _ANSWER_DELAY_S * self._chance())
        elif serial > self.roster.serial:
            self._schedule(Request, now_s, _ANSWER_DELAY_S * self._chance())
        else:
            self.is_agreed = True

    def handle_roster(self, now_s: float, data: bytes) -> bool:
        """Handle a roster from anybody; return whether it is newer, genuine, and of this colony, and is adopted."""
        if data == self.signed:
            self._due_s.pop(Publish, None)  # another member has published it
            return False
        if not self._verify_limit.allow(now_s):
            return False
        try:
            roster = open_roster(data, self._authority_key)
        except WireError:
            return False
        if roster.colony != self.roster.colony or roster.serial <= self.roster.serial:
            return False
        self.signed, self.roster = data, roster
        self._due_s.clear()
        return True

    def answer(self, request: bytes) -> bytes | None:
        """Return the reply to a request: the own roster if it is newer, or None."""
        serial = _serial_in(request)
        return self.signed if serial is not None and serial < self.roster.serial else None

    def due_actions(self, now_s: float) -> list[Action]:
        """Return what is to be done now."""
        due = [kind for kind, due_s in self._due_s.items() if due_s <= now_s]
        for kind in due:
            del self._due_s[kind]
            self._done_s[kind] = now_s
        return [self._action(kind) for kind in due]

    def _action(self, kind: type[Action]) -> Action:
        if kind is Publish:
            return Publish(self.signed)
        message = encode(RosterSerial(self.roster.serial))
        return Announce(message) if kind is Announce else Request(message)

    def _schedule(self, kind: type[Action], now_s: float, delay_s: float) -> None:
        earliest_s = self._done_s.get(kind, -math.inf) + _PERIOD_S
        self._due_s.setdefault(kind, max(now_s + delay_s, earliest_s))


def _serial_in(data: bytes) -> int | None:
    try:
        return decode_roster_serial(data).serial
    except WireError:
        return None


decode_roster_serial = StrictDecoder[RosterSerial](RosterSerial, 64).decode
