"""Two beacons that hear each other become a contact, with the same nonce on both sides; nothing else does."""

import random
from collections.abc import Callable

import pytest
from crcolony_bridge.infrared.beacon import TOKEN_BYTES, Beacon, BeaconMessage, decode_beacon
from hypothesis import given
from hypothesis import strategies as st

from crcolony.protocol.body_messages import Contact

A, B, C = (bytes([k]) * 16 for k in (1, 2, 3))


def drawing(seed: int) -> Callable[[int], bytes]:
    """Return a source of random bytes."""
    return random.Random(seed).randbytes


@pytest.fixture
def pair() -> tuple[Beacon, Beacon]:
    """Two beacons."""
    return Beacon(A, drawing(1)), Beacon(B, drawing(2))


def test_both_sides_have_one_contact_with_the_same_nonce(pair: tuple[Beacon, Beacon]) -> None:
    """Once each has heard that the other has heard it."""
    a, b = pair
    assert b.receive(a.message(0.0)) is None
    at_a = a.receive(b.message(0.0))
    at_b = b.receive(a.message(0.0))
    assert at_a is not None
    assert at_a.robot == B
    assert at_b == Contact(A, at_a.nonce)
    assert a.receive(b.message(0.0)) is None, "it is reported once"


def test_who_is_not_heard_has_no_contact(pair: tuple[Beacon, Beacon]) -> None:
    """A beacon alone proves nothing: the other may be blind, or switched off."""
    a, b = pair
    assert all(b.receive(a.message(0.1 * k)) is None for k in range(100))


def test_an_old_message_makes_no_contact(pair: tuple[Beacon, Beacon]) -> None:
    """A recording of a meeting, played to one of the two later."""
    a, b = pair
    b.receive(a.message(0.0))
    recorded = b.message(0.0)
    assert a.receive(recorded) is not None
    a.message(100.0)
    assert a.receive(recorded) is None


def test_robots_that_stay_together_have_contacts_again(pair: tuple[Beacon, Beacon]) -> None:
    """Every few seconds, each with another nonce."""
    a, b = pair
    nonces = []
    for k in range(300):
        b.receive(a.message(0.1 * k))
        contact = a.receive(b.message(0.1 * k))
        if contact is not None:
            nonces.append(contact.nonce)
    assert 5 <= len(nonces) <= 12
    assert len(set(nonces)) == len(nonces)


def test_a_robot_that_does_not_want_to_mate_has_no_contact(pair: tuple[Beacon, Beacon]) -> None:
    """On neither side, although its beacon still says what a mating needs."""
    a, b = pair
    a.is_ready = False
    a.load(0.0, b"an envelope")
    for k in range(20):
        assert b.receive(a.message(0.1 * k)) is None
        assert a.receive(b.message(0.1 * k)) is None
    assert a.has_envelope(2.0)
    assert decode_beacon(a.message(2.0).encode()) == a.message(2.0)
    assert not a.has_envelope(4.0)


def test_the_own_reflection_is_no_contact() -> None:
    """Infrared comes back from walls."""
    beacon = Beacon(A, drawing(1))
    for _ in range(3):
        assert beacon.receive(beacon.message(0.0)) is None


def test_three_robots_have_contacts_pairwise() -> None:
    """Each pair its own nonce."""
    beacons = {robot: Beacon(robot, drawing(robot[0])) for robot in (A, B, C)}
    contacts = set()
    for k in range(200):
        speaker = beacons[(A, B, C)[k % 3]]
        message = speaker.message(0.05 * k)
        for beacon in beacons.values():
            contact = beacon.receive(message)
            if contact is not None:
                contacts.add((frozenset({beacon.robot, contact.robot}), contact.nonce))
    assert {pair for pair, _ in contacts} == {frozenset(p) for p in ((A, B), (B, C), (A, C))}


@given(st.binary(max_size=64))
def test_whatever_emits_infrared_does_no_harm(data: bytes) -> None:
    """Bytes are a message of a beacon, or nothing."""
    message = decode_beacon(data)
    assert message is None or message.encode() == data


def test_a_message_fits_into_one_fragment() -> None:
    """With its digest: most robots are in sight of each other only for a moment."""
    assert len(BeaconMessage(A, bytes(TOKEN_BYTES)).encode()) + 4 <= 48
