"""A bridge stands in for robots that are met and are on no network, for no others, and for no longer than necessary."""

import pytest
from crcolony_bridge.infrared.relay import AbsentRobots, parties_of
from hypothesis import given
from hypothesis import strategies as st

from crcolony.protocol.envelope import sign_message
from crcolony.protocol.identity import Identity, RobotId
from crcolony.protocol.mating_messages import Commit, Encounter
from crcolony.protocol.token_set import TokenTable

A, B = Identity(bytes(32)), Identity(bytes([1]) * 32)


def nobody(_: RobotId) -> bool:
    """No robot has a body here."""
    return False


@pytest.fixture
def online() -> TokenTable:
    """A network without robots."""
    return TokenTable()


def test_a_robot_that_is_met_and_absent_is_stood_in_for(online: TokenTable) -> None:
    """After a moment, in which its token may arrive, and until it was not received for a while."""
    absent = AbsentRobots(online)
    absent.receive(0.0, B.id, "blue")
    assert absent.update(0.5, nobody) == {}
    absent.receive(1.0, B.id, "blue")
    assert absent.update(1.5, nobody) == {B.id: "blue"}
    assert absent.update(12.0, nobody) == {}


def test_a_robot_that_is_on_the_network_is_not(online: TokenTable) -> None:
    """At once, when it appears there."""
    absent = AbsentRobots(online)
    absent.receive(0.0, B.id, "blue")
    absent.receive(2.0, B.id, "blue")
    assert absent.update(2.0, nobody) == {B.id: "blue"}
    online.add(B.id, (7, "its own session"))
    assert absent.update(2.1, nobody) == {}


def test_a_robot_that_has_a_body_here_is_not(online: TokenTable) -> None:
    """Two bodies of one bridge need no relay."""
    absent = AbsentRobots(online)
    absent.receive(0.0, B.id, "blue")
    assert absent.update(2.0, lambda robot: robot == B.id) == {}


def test_a_flood_of_ids_takes_no_memory(online: TokenTable) -> None:
    """Whatever emits infrared may call itself anything."""
    absent = AbsentRobots(online)
    for k in range(10_000):
        absent.receive(0.0001 * k, k.to_bytes(16, "big"), "blue")
    assert len(absent.update(2.0, nobody)) <= 16


def test_an_envelope_says_from_whom_and_for_whom_it_is() -> None:
    """Its content says so."""
    message = Commit(Encounter(A.id, B.id, 3, 7))
    assert parties_of(sign_message(message, "colony", A)) == (A.id, B.id)


@given(st.binary(max_size=200))
def test_noise_is_no_envelope(data: bytes) -> None:
    """And raises nothing."""
    assert parties_of(data) is None
