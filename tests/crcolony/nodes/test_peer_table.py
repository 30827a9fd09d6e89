"""A robot knows which peers are online, and notices another process with its own key."""

import pytest

from crcolony.nodes.peer_table import PeerTable
from tests.support.lone_robot import ME, PEER


@pytest.fixture
def peers() -> PeerTable:
    """The table of a robot in its fifth incarnation, started at time 0."""
    table = PeerTable(ME.id, 5)
    table.session = "m"
    table.start(0.0)
    return table


def test_a_peer_is_online_while_one_of_its_sessions_is(peers: PeerTable) -> None:
    """Only the first session and the last change that."""
    assert peers.add(1.0, PEER.id, (1, "a"))
    assert not peers.add(2.0, PEER.id, (2, "b"))
    assert not peers.add(2.0, PEER.id, (2, "b"))
    assert PEER.id in peers
    assert not peers.remove(PEER.id, (1, "a"))
    assert list(peers) == [PEER.id]
    assert peers.remove(PEER.id, (2, "b"))
    assert PEER.id not in peers
    assert len(peers) == 0


def test_removing_an_unknown_session_changes_nothing(peers: PeerTable) -> None:
    """Neither of an unknown peer nor of one that is online in another session."""
    assert not peers.remove(PEER.id, (1, "a"))
    peers.add(1.0, PEER.id, (1, "a"))
    assert not peers.remove(PEER.id, (1, "b"))
    assert PEER.id in peers


@pytest.mark.parametrize(("incarnation", "session"), [(4, "z"), (5, "a")])
def test_an_older_process_with_the_same_key_is_a_duplicate(
    peers: PeerTable, incarnation: int, session: str
) -> None:
    """Of an earlier incarnation, or of the same and a smaller session; it is reported once it outlives two leases."""
    assert not peers.add(1.0, ME.id, (incarnation, session))
    assert peers.has_duplicate
    assert ME.id not in peers
    assert peers.duplicate_session(8.0) is None
    assert peers.duplicate_session(8.1) == session
    assert not peers.remove(ME.id, (incarnation, session))
    assert not peers.has_duplicate
    assert peers.duplicate_session(100.0) is None


def test_the_own_token_is_no_duplicate(peers: PeerTable) -> None:
    """Nor is that of a younger process, which will stop by itself."""
    peers.add(1.0, ME.id, (5, "m"))
    peers.add(1.0, ME.id, (6, "a"))
    assert not peers.has_duplicate


def test_a_token_that_appears_after_the_start_is_no_duplicate(peers: PeerTable) -> None:
    """Anyone may forge one: it must not stop a running robot."""
    peers.add(10.1, ME.id, (1, "hostile"))
    assert not peers.has_duplicate


def test_a_new_session_has_no_peers(peers: PeerTable) -> None:
    """Clearing returns who was online, each once."""
    peers.add(1.0, PEER.id, (1, "a"))
    peers.add(1.0, PEER.id, (2, "b"))
    assert peers.clear() == [PEER.id]
    assert PEER.id not in peers
    assert peers.clear() == []
