"""Two beacons that hear each other become a contact, with the same nonce on both sides; nothing else does."""

import random
from collections.abc import Callable

import pytest
from crcolony_bridge.infrared.beacon import Beacon, BeaconForm
from crcolony_bridge.infrared.whole_beacon import FORM

from crcolony.protocol.body_messages import Contact

A, B, C = (bytes([k]) * 16 for k in (1, 2, 3))


def drawing(seed: int) -> Callable[[int], bytes]:
    """Return a source of random bytes."""
    return random.Random(seed).randbytes


@pytest.fixture
def pair() -> tuple[Beacon, Beacon]:
    """Two beacons."""
    return Beacon(A, FORM, drawing(1)), Beacon(B, FORM, drawing(2))


def test_both_sides_have_one_contact_with_the_same_nonce(pair: tuple[Beacon, Beacon]) -> None:
    """Once each has heard that the other has heard it."""
    a, b = pair
    assert b.receive(0.0, a.message(0.0)) is None
    at_a = a.receive(0.0, b.message(0.0))
    at_b = b.receive(0.0, a.message(0.0))
    assert at_a is not None
    assert at_a.robot == B
    assert at_b == Contact(A, at_a.nonce)
    assert a.receive(0.0, b.message(0.0)) is None, "it is reported once"


def test_who_is_not_heard_has_no_contact(pair: tuple[Beacon, Beacon]) -> None:
    """A beacon alone proves nothing: the other may be blind, or switched off."""
    a, b = pair
    assert all(b.receive(0.1 * k, a.message(0.1 * k)) is None for k in range(100))


def test_an_old_message_makes_no_contact(pair: tuple[Beacon, Beacon]) -> None:
    """A recording of a meeting, played to one of the two later."""
    a, b = pair
    b.receive(0.0, a.message(0.0))
    recorded = b.message(0.0)
    assert a.receive(0.0, recorded) is not None
    a.message(100.0)
    assert a.receive(100.0, recorded) is None


def test_robots_that_stay_together_have_contacts_again(pair: tuple[Beacon, Beacon]) -> None:
    """Every few seconds, each with another nonce."""
    a, b = pair
    nonces = []
    for k in range(300):
        b.receive(0.1 * k, a.message(0.1 * k))
        contact = a.receive(0.1 * k, b.message(0.1 * k))
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
        assert b.receive(0.1 * k, a.message(0.1 * k)) is None
        assert a.receive(0.1 * k, b.message(0.1 * k)) is None
    assert a.must_be_on(2.0)
    assert a.message(2.0).envelope == b"an envelope"
    assert not a.must_be_on(4.0)


def test_the_own_reflection_is_no_contact() -> None:
    """Infrared comes back from walls."""
    beacon = Beacon(A, FORM, drawing(1))
    for _ in range(3):
        assert beacon.receive(0.0, beacon.message(0.0)) is None


def test_three_robots_have_contacts_pairwise() -> None:
    """Each pair its own nonce."""
    beacons = {robot: Beacon(robot, FORM, drawing(robot[0])) for robot in (A, B, C)}
    contacts = set()
    for k in range(200):
        speaker = beacons[(A, B, C)[k % 3]]
        message = speaker.message(0.05 * k)
        for beacon in beacons.values():
            contact = beacon.receive(0.05 * k, message)
            if contact is not None:
                contacts.add((frozenset({beacon.robot, contact.robot}), contact.nonce))
    assert {pair for pair, _ in contacts} == {frozenset(p) for p in ((A, B), (B, C), (A, C))}


def test_a_beacon_whose_messages_are_short_has_no_envelope() -> None:
    """Its robots must be on the network."""
    beacon = Beacon(A, BeaconForm(2, 16.0, has_envelopes=False), drawing(1))
    beacon.load(0.0, b"an envelope")
    assert not beacon.must_be_on(0.0)
    assert beacon.message(0.0).envelope == b""
    assert len(beacon.message(0.0).token) == 2


def test_after_a_contact_a_beacon_stays_on_until_the_other_side_has_it() -> None:
    """And says that it has heard that one, not a third one, although its robot does not want to mate any more."""
    form = BeaconForm(2, 16.0, has_envelopes=False, answer_s=2.0)
    a, b, c = (Beacon(robot, form, drawing(robot[0])) for robot in (A, B, C))
    b.receive(0.0, a.message(0.0))
    assert a.receive(0.0, b.message(0.0)) is not None
    a.is_ready = False
    a.receive(0.5, c.message(0.5))
    assert a.must_be_on(1.9)
    assert b.receive(1.9, a.message(1.9)) is not None
    assert not a.must_be_on(2.0)
    a.receive(2.0, c.message(2.0))
    assert a.message(2.0).heard == c.message(2.0).token


def test_a_token_is_never_zeros() -> None:
    """These say that nothing was heard."""
    beacon = Beacon(A, BeaconForm(2, 16.0, has_envelopes=False), bytes)
    assert any(beacon.message(0.0).token)
