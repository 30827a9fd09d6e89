"""Lets samples pass that those signed whose they say they are, as many a second as an observer can afford.

Robots sign with the key of their id. An arena signs with its own: the first of a name is believed until it is silent.
No I/O, no clock, one thread.
"""

from collections.abc import Iterable, Iterator

from crcolony.protocol.codec import WireError
from crcolony.protocol.identity import ArenaId, arena_id, robot_id
from crcolony.protocol.key_expressions import parse_arena_topic, parse_robot_topic
from crcolony.protocol.signed_telemetry import (
    SignedTelemetry,
    open_telemetry,
    purpose_of_arena,
    purpose_of_robot,
)
from crcolony.rate_limit import TokenBucket
from crcolony.telemetry.samples import RawSample

_MAX_STATES_PER_S = 400.0
"""States whose signatures are verified, 0.07 ms each: of a thousand robots each is new every 2.5 s."""
_MAX_OTHERS_PER_S = 2_000.0
"""Events, scenes and replies whose signatures are verified."""
_MAX_KEYS = 20_000
"""Robots, and arenas, of which something is remembered."""
_SILENT_S = 3.0
"""An arena that says nothing for so long makes room for another one of its name."""


class SampleVerifier:
    """Verifies samples, and keeps what is needed to tell old states from new ones."""

    def __init__(self) -> None:
        self.refused = 0
        """Samples that nobody signed who may say this, and states that are older than one that was believed"""
        self.skipped = 0
        """Samples beyond what is verified in a second"""
        self._arenas: dict[str, tuple[ArenaId, float]] = {}
        """By name, the arena that is believed, and when it said something last"""
        self._waiting: dict[str, RawSample] = {}
        """By key, the last state that waits: each takes the place of the one before"""
        self._counts: dict[str, int] = {}
        """By key, the count of the last state that was believed; the latest at the end"""
        self._state_limit = TokenBucket(_MAX_STATES_PER_S)
        self._other_limit = TokenBucket(_MAX_OTHERS_PER_S)

    def open_all(self, now_s: float, samples: Iterable[RawSample]) -> Iterator[RawSample]:
        """Yield the samples that are believed, without their signatures; states may come with a later call."""
        for raw in samples:
            if raw.kind in ("online", "offline"):
                yield raw  # tokens cannot be signed
            elif raw.kind == "state":
                self._wait(raw)
            elif self._other_limit.allow(now_s):
                yield from self._open(now_s, raw)
            else:
                self.skipped += 1
        while self._waiting and self._state_limit.allow(now_s):
            key = next(iter(self._waiting))
            yield from self._open(now_s, self._waiting.pop(key))

    def _wait(self, raw: RawSample) -> None:
        if raw.key in self._waiting or len(self._waiting) < _MAX_KEYS:
            self._waiting[raw.key] = raw
        else:
            self.skipped += 1

    def _open(self, now_s: float, raw: RawSample) -> Iterator[RawSample]:
        try:
            telemetry = open_telemetry(raw.payload)
        except WireError:
            self.refused += 1
            return
        if self._is_of_its_robot(raw, telemetry) or self._is_of_its_arena(now_s, raw, telemetry):
            yield raw._replace(payload=telemetry.content)
        else:
            self.refused += 1

    def _is_of_its_robot(self, raw: RawSample, telemetry: SignedTelemetry) -> bool:
        named = parse_robot_topic(raw.key, raw.kind)
        if named is None or robot_id(telemetry.key) != named[1]:
            return False
        if raw.kind != "state":
            return telemetry.is_valid(purpose_of_robot(named[0]))
        is_old = telemetry.count <= self._counts.get(raw.key, -1)
        if is_old or not telemetry.is_valid(purpose_of_robot(named[0])):
            return False
        self._counts.pop(raw.key, None)
        self._counts[raw.key] = telemetry.count
        if len(self._counts) > _MAX_KEYS:
            del self._counts[next(iter(self._counts))]
        return True

    def _is_of_its_arena(self, now_s: float, raw: RawSample, telemetry: SignedTelemetry) -> bool:
        name = parse_arena_topic(raw.key, raw.kind)
        if name is None:
            return False
        signer = arena_id(telemetry.key)
        believed, said_s = self._arenas.get(name, (signer, now_s))
        is_other = signer != believed and now_s < said_s + _SILENT_S
        is_too_many = name not in self._arenas and len(self._arenas) >= _MAX_KEYS
        if is_other or is_too_many or not telemetry.is_valid(purpose_of_arena(name)):
            return False
        self._arenas[name] = signer, now_s
        return True
