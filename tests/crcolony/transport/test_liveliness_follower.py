"""A token is online once and gone once, whichever sessions have seen it."""

from collections.abc import Iterator
from typing import Any

import pytest
import zenoh

from crcolony.transport.liveliness_follower import LivelinessFollower
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import free_port, has_links, open_session
from tests.support.process import wait_until


class Followed:
    """A follower that moves between two sessions, and peers that declare tokens."""

    def __init__(self, port: int, opened: list[zenoh.Session]) -> None:
        self._endpoint, self._opened = f"tcp/127.0.0.1:{port}", opened
        self.seed = self._open(NetworkSettings(listen=(self._endpoint,)))
        self.first, self.second = self.join(), self.join()
        self.changes: list[tuple[str, bool]] = []
        self.follower = LivelinessFollower(
            self.first, "tokens/*", lambda key, online: self.changes.append((key, online))
        )

    def join(self) -> zenoh.Session:
        session = self._open(NetworkSettings(connect=(self._endpoint,)))
        wait_until(lambda: has_links(session), "a link")
        return session

    def _open(self, network: NetworkSettings) -> zenoh.Session:
        self._opened.append(session := open_session(network))
        return session

    def declare(self, name: str) -> Any:
        return self.seed.liveliness().declare_token(f"tokens/{name}")

    def wait_for(self, *changes: tuple[str, bool]) -> None:
        wait_until(lambda: len(self.changes) >= len(changes), f"{changes}, not {self.changes}")
        assert self.changes == [(f"tokens/{name}", online) for name, online in changes]


@pytest.fixture
def followed() -> Iterator[Followed]:
    opened: list[zenoh.Session] = []
    yield Followed(free_port(), opened)
    for session in opened:
        session.close()  # type: ignore[no-untyped-call]


def test_a_token_that_both_sessions_see_is_reported_once(followed: Followed) -> None:
    """When it appears and when it goes, also while both are followed."""
    token = followed.declare("a")
    followed.wait_for(("a", True))
    leave = followed.follower.move_to(followed.second)
    other = followed.declare("b")
    followed.wait_for(("a", True), ("b", True))
    token.undeclare()
    followed.wait_for(("a", True), ("b", True), ("a", False))
    leave()
    other.undeclare()
    followed.wait_for(("a", True), ("b", True), ("a", False), ("b", False))


def test_a_token_that_the_next_session_does_not_see_is_gone(followed: Followed) -> None:
    """As of a member that the access control of the next session denies."""
    followed.follower._on_sample(followed.follower._seen[0], _put("tokens/denied"))
    followed.wait_for(("denied", True))
    followed.follower.move_to(followed.second)()
    followed.wait_for(("denied", True), ("denied", False))


def test_nobody_makes_it_follow_without_limit(
    followed: Followed, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Further tokens are ignored, and so are their ends."""
    monkeypatch.setattr("crcolony.transport.liveliness_follower._MAX_TOKENS", 2)
    tokens = [followed.declare(name) for name in "abc"]
    followed.wait_for(("a", True), ("b", True))
    tokens[2].undeclare()
    tokens[0].undeclare()
    followed.wait_for(("a", True), ("b", True), ("a", False))


def _put(key: str) -> Any:
    class Sample:
        key_expr = key
        kind = zenoh.SampleKind.PUT

    return Sample()


def test_a_token_with_a_long_key_is_not_kept(followed: Followed) -> None:
    """Anybody can declare one; it neither comes nor goes, and the next one does."""
    long = followed.declare("a" * 50_000)
    token = followed.declare("b")
    followed.wait_for(("b", True))
    long.undeclare()
    token.undeclare()
    followed.wait_for(("b", True), ("b", False))
