"""A peer that stays without a liveliness token is reported, once."""

from typing import Any, cast

import pytest

from crcolony.transport.liveliness_check import LivelinessCheck


class FakeSession:
    """A Zenoh session with peers, some of which have tokens."""

    def __init__(self) -> None:
        self.peers: set[str] = set()
        self.with_token: set[str] = set()
        self.queries = 0
        self.info = self

    def peers_zid(self) -> list[str]:
        return sorted(self.peers)

    def liveliness(self) -> "FakeSession":
        return self

    def get(self, key: str, handler: Any, timeout: float) -> None:
        self.queries += 1
        for session in self.with_token:
            self.check._with_token.add(session)

    check: LivelinessCheck


@pytest.fixture
def session() -> FakeSession:
    """A session, with its check."""
    fake = FakeSession()
    fake.check = LivelinessCheck(cast(Any, fake))
    return fake


def missing(session: FakeSession, seconds: int) -> list[tuple[int, str]]:
    """Check every second; return when which peers were reported."""
    return [
        (second, peer)
        for second in range(1, seconds)
        for peer in session.check.find_missing(float(second))
    ]


def test_a_peer_without_a_token_is_reported_once_after_15_s(session: FakeSession) -> None:
    """Tokens are queried every 5 s; a peer with a token is never reported."""
    session.peers, session.with_token = {"a", "b"}, {"a"}
    assert missing(session, 60) == [(21, "b")]
    assert session.queries == 12


def test_a_peer_whose_token_arrives_meanwhile_is_not_reported(session: FakeSession) -> None:
    """Connections are made before tokens arrive."""
    session.peers = {"b"}
    assert not missing(session, 15)
    session.with_token = {"b"}
    assert not [peer for second in range(15, 60) for peer in session.check.find_missing(second)]
