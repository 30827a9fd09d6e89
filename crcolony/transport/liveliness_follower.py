"""Follows liveliness tokens through changes of the session: a token is gone when no session has it any more."""

import threading
from collections.abc import Callable
from typing import Any

import zenoh

from crcolony.transport.zenoh_samples import callback, undeclare_all

_MAX_TOKENS = 20_000
"""Tokens that are followed; anybody may declare any number, and further ones are ignored."""
_MAX_KEY_LENGTH = 400
"""No token of this protocol has a longer key; a longer one is not kept."""

OnToken = Callable[[str, bool], None]
"""Receives the key of a token, and whether it is online; called by Zenoh's threads, one at a time."""


class LivelinessFollower:
    """Subscribes to the tokens of a key expression, in one session after the other."""

    def __init__(self, session: zenoh.Session, key: str, on_token: OnToken) -> None:
        self._key, self._on_token = key, on_token
        self._mutex = threading.Lock()
        self._seen: list[set[str]] = []
        """By session, the last one at the end"""
        self._subscriber = self._subscribe(session)

    def move_to(self, session: zenoh.Session) -> Callable[[], None]:
        """Subscribe in another session; return a function that unsubscribes in the former one.

        What that one had seen and the other one does not see is reported to be gone.
        """
        former = self._subscriber
        self._subscriber = self._subscribe(session)

        def leave() -> None:
            undeclare_all([former])
            with self._mutex:
                seen = self._seen.pop(0)
                for key in seen.difference(*self._seen):
                    self._on_token(key, False)

        return leave

    def undeclare(self) -> None:
        """Follow no longer."""
        undeclare_all([self._subscriber])

    def _subscribe(self, session: zenoh.Session) -> Any:
        seen: set[str] = set()
        with self._mutex:
            self._seen.append(seen)
        return session.liveliness().declare_subscriber(
            self._key, callback(lambda sample: self._on_sample(seen, sample)), history=True
        )

    def _on_sample(self, seen: set[str], sample: zenoh.Sample) -> None:
        key = str(sample.key_expr)
        if len(key) > _MAX_KEY_LENGTH:
            return
        with self._mutex:
            is_known = any(key in one for one in self._seen)
            if sample.kind == zenoh.SampleKind.PUT:
                if len(seen) < _MAX_TOKENS:
                    seen.add(key)
                    if not is_known:
                        self._on_token(key, True)
            elif key in seen:
                seen.discard(key)
                if not any(key in one for one in self._seen):
                    self._on_token(key, False)
