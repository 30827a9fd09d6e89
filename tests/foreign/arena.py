"""How the robot gets a body, keeps it, and gives it back (PROTOCOL.md, "Getting a body")."""

from collections.abc import Callable
from typing import Final

from nacl.signing import SigningKey

from tests.foreign.body_link import Link, LinkedBody, Request, body_request, granted, leave_request
from tests.foreign.records import Records

REQUEST_S: Final = 1.0
SILENCE_S: Final = 3.0


class Arena:
    """The arena of this name, as one robot knows it; `ask` sends a request."""

    def __init__(
        self,
        name: str,
        key: SigningKey,
        who: tuple[bytes, str, int],
        records: Records,
        ask: Callable[[bytes], None],
    ) -> None:
        self.name = name
        self.body: LinkedBody | None = None
        self._key, self._records, self._ask = key, records, ask
        self._robot, self._colony, self._incarnation = who
        self._tokens: dict[tuple[int, str], None] = {}
        """Run and session of its tokens, the newest last"""
        self._request: Request | None = None
        """Not answered yet"""
        self._count = 0
        self._asked_s = self._observed_s = 0.0

    def token(self, arena_run: int, session: str, is_online: bool) -> None:
        """A run is over when its last token has gone: it may have changed its session."""
        if is_online:
            self._tokens[arena_run, session] = None
            return
        self._tokens.pop((arena_run, session), None)
        is_over = all(run != arena_run for run, _ in self._tokens)
        if is_over and self.body is not None and self.body.link.arena_run == arena_run:
            self.body = None

    def pass_time(self, now_s: float) -> None:
        """Ask for a body while there is none, or it is silent; the same until that is answered."""
        is_served = self.body is not None and now_s < self._observed_s + SILENCE_S
        if is_served or not self._tokens or now_s < self._asked_s + REQUEST_S:
            return
        self._asked_s = now_s
        arena_run, _ = next(reversed(self._tokens))
        if self._request is None or self._request.arena_run != arena_run:
            self._count += 1
            slot = -1 if self.body is None else self.body.link.slot
            who = [self._robot, self._colony, slot, arena_run, self._incarnation, self._count]
            self._request = body_request(self._key, self.name, ["join", *who])
        self._ask(self._request.envelope)

    def reply(self, payload: bytes, now_s: float) -> str:
        """What a reply says, for people; empty if it answers nothing."""
        if self._request is None:
            return ""
        fact = f"arena {self.name}"
        known = self._records.fact(fact)
        link = granted(self._request, payload, self.name, known)
        self._request = None
        if not isinstance(link, Link):
            return f"no body: {link}"
        if known is None:  # the first arena of this name: from now on it lives in no other
            with self._records.write():
                self._records.set_fact(fact, link.arena_id)
        former, self.body, self._observed_s = self.body, LinkedBody(link), now_s
        if former is not None and former.link.arena_run == link.arena_run:
            self.body.tick = former.tick
        return f"has body {link.slot}"

    def observed(self, now_s: float) -> float:
        """An observation has come; how long after the last one (s)."""
        period_s, self._observed_s = now_s - self._observed_s, now_s
        return period_s

    def leave(self) -> None:
        if self.body is not None:
            self._count += 1
            message = [
                "leave",
                self._robot,
                self.body.link.arena_run,
                self._incarnation,
                self._count,
            ]
            self._ask(leave_request(self._key, self.name, message))
            self.body = None
