"""Words of 11 bits become messages of neighbours, and these contacts with one nonce on both sides; noise nothing."""

import random
from collections.abc import Sequence
from dataclasses import dataclass, field

import pytest
from crcolony_bridge.infrared.beacon import Beacon, BeaconMessage
from crcolony_bridge.infrared.short_beacon import (
    PLACES,
    WORD_BYTES,
    WORD_LIMIT,
    WORD_S,
    ShortEncoding,
    WordReceiver,
    WordSender,
    encode_short,
    hash_id,
    word_at,
)
from hypothesis import given
from hypothesis import strategies as st

from crcolony.protocol.body_messages import Contact

IDS = [bytes([k]) * 16 for k in range(1, 5)]
A, B, C, _ = IDS
PERIOD_S = 0.1
MESSAGE_S = PLACES * WORD_S
CONTACT_S = 2.0
"""A mating begins so long after a contact at most: that of the other side must not come later"""


@dataclass
class Robot:
    """A robot whose infrared emits its word every 0.1 s."""

    beacon: Beacon
    encoding: ShortEncoding
    emits_from_s: float
    contacts: list[tuple[float, Contact]] = field(default_factory=list)

    @classmethod
    def new(cls, robot: bytes, rng: random.Random) -> "Robot":
        encoding = ShortEncoding(robot)
        beacon = Beacon(robot, encoding.form, rng.randbytes)
        return cls(beacon, encoding, rng.random() * MESSAGE_S)


def meet(robots: Sequence[Robot], duration_s: float, loss: float, rng: random.Random) -> None:
    """Let robots face each other; their beacons have begun at different times."""
    said = {robot.beacon.robot: b"" for robot in robots}
    for step in range(round((duration_s + MESSAGE_S) / PERIOD_S)):
        now_s = step * PERIOD_S - MESSAGE_S
        for robot in robots:
            others = [said[r.beacon.robot] for r in robots if r is not robot]
            heard = [word for word in others if word and now_s >= 0.0 and rng.random() >= loss]
            for message in robot.encoding.decode(now_s, heard, IDS):
                if (contact := robot.beacon.receive(now_s, message)) is not None:
                    robot.contacts.append((now_s, contact))
        for robot in robots:
            if now_s + MESSAGE_S >= robot.emits_from_s:
                message = robot.beacon.message(now_s)
                said[robot.beacon.robot] = robot.encoding.encode(now_s, message)


@pytest.mark.parametrize(
    ("loss", "median_s", "in_time"), [(0.0, 3, 60), (0.1, 3.5, 54), (0.3, 5, 45)]
)
def test_two_robots_have_the_same_contact_soon_after_each_other(
    loss: float, median_s: float, in_time: int
) -> None:
    """Within a few seconds, and of 60 pairs most near enough in time for a mating."""
    took_s, apart_s = [], []
    for seed in range(60):
        rng = random.Random(seed)
        pair = [Robot.new(robot, rng) for robot in (A, B)]
        meet(pair, 16.0, loss, rng)
        (at_a, of_a), (at_b, of_b) = (robot.contacts[0] for robot in pair)
        assert (of_a.robot, of_b.robot) == (B, A)
        assert of_a.nonce == of_b.nonce
        took_s.append(max(at_a, at_b))
        apart_s.append(abs(at_a - at_b))
    assert sorted(took_s)[30] < median_s
    assert sum(apart < CONTACT_S for apart in apart_s) >= in_time


def test_three_robots_that_are_heard_at_once_have_contacts_pairwise() -> None:
    """Their words interleave for as long as they are together."""
    rng = random.Random(3)
    robots = [Robot.new(robot, rng) for robot in (A, B, C)]
    meet(robots, 60.0, 0.1, rng)
    for robot in robots:
        assert {contact.robot for _, contact in robot.contacts} == {A, B, C} - {robot.beacon.robot}
    nonces = [{contact.nonce for _, contact in robot.contacts} for robot in robots]
    assert len(nonces[0] & nonces[1]) > 0


def test_robots_that_stay_together_have_a_contact_for_each_pair_of_tokens() -> None:
    """A token lives for several messages."""
    rng = random.Random(1)
    pair = [Robot.new(robot, rng) for robot in (A, B)]
    meet(pair, 100.0, 0.0, rng)
    assert 5 <= len(pair[0].contacts) <= 14
    assert len({contact.nonce for _, contact in pair[0].contacts}) == len(pair[0].contacts)


def sent(message: BeaconMessage) -> list[bytes]:
    """Return the words of a message, in order."""
    words = (word_at(place, byte) for place, byte in enumerate(encode_short(message)))
    return [word.to_bytes(WORD_BYTES, "big") for word in words]


MESSAGE = BeaconMessage(B, b"\x01\x02", b"\x03\x04")


def test_a_message_has_these_words() -> None:
    """As PROTOCOL.md says."""
    assert b"".join(sent(MESSAGE)).hex() == "005a014e0201030204030504062b0745"


@given(st.randoms(use_true_random=False), st.integers(1, 3))
def test_words_in_any_order_and_repeated_are_the_message(
    shuffled: random.Random, times: int
) -> None:
    """Each names its place."""
    words = sent(MESSAGE) * times
    shuffled.shuffle(words)
    assert set(_messages(words)) == {MESSAGE}


@given(st.integers(0, PLACES - 1), st.integers(1, 255))
def test_a_damaged_word_makes_no_message(place: int, flipped: int) -> None:
    """The checksum finds it."""
    words = sent(MESSAGE)
    words[place] = (int.from_bytes(words[place], "big") ^ flipped).to_bytes(WORD_BYTES, "big")
    assert _messages(words) == []


def test_words_that_are_too_old_are_no_part_of_a_message() -> None:
    """Of a robot that was here before."""
    encoding = ShortEncoding(A)
    words = sent(MESSAGE)
    assert encoding.decode(0.0, words[:-1], IDS) == []
    assert encoding.decode(10.0, words[-1:], IDS) == []
    assert encoding.decode(10.1, words, IDS) == [MESSAGE]


def test_a_robot_that_is_not_on_the_network_or_not_told_from_another_is_not_met() -> None:
    """Two ids with one hash are two robots; and our own beacon comes back from walls."""
    numbers = iter(range(10**6))
    twin = next(
        robot
        for robot in (k.to_bytes(16, "big") for k in numbers)
        if hash_id(robot) == hash_id(B) and robot != B
    )
    assert _messages(sent(MESSAGE), online=(A, C)) == []
    assert _messages(sent(MESSAGE), online=(A, B, C)) == [MESSAGE]
    assert _messages(sent(MESSAGE), online=(A, B, twin)) == []
    assert _messages(sent(MESSAGE), robot=B, online=(B,)) == []
    assert _messages(sent(MESSAGE), robot=twin, online=(B,)) == []


def _messages(
    words: Sequence[bytes], robot: bytes = A, online: Sequence[bytes] = tuple(IDS)
) -> list[BeaconMessage]:
    return ShortEncoding(robot).decode(0.0, words, online)


@given(st.lists(st.binary(max_size=4), max_size=60), st.floats(0.0, 10.0))
def test_whatever_emits_infrared_does_no_harm(received: list[bytes], now_s: float) -> None:
    """No error, and by chance a message at most of a robot that is there."""
    for message in ShortEncoding(A).decode(now_s, received, IDS):
        assert message.robot in IDS


@given(st.lists(st.integers(0, 2**16 - 1), max_size=200))
def test_a_flood_of_words_takes_no_memory(words: list[int]) -> None:
    """Some for each place, whatever is received."""
    receiver = WordReceiver(keep_s=5.0)
    for k, word in enumerate(words):
        list(receiver.add(0.01 * k, word))
    assert sum(map(len, receiver._values)) <= 3 * PLACES


def test_a_word_is_sent_for_its_time_and_what_has_changed_comes_first() -> None:
    """All of a message is sent before the next one, which may come at any time."""
    sender = WordSender(WORD_S)
    first, second = bytes(range(8)), bytes([0, 1, 2, 3, 9, 9, 9, 9])
    words = [sender.word(0.1 * k, first if k < 5 else second) for k in range(32)]
    assert words[0:32:2] == words[1:32:2], "each for 0.2 s"
    places = [word >> 8 for word in words[::2]]
    assert places == [0, 1, 2, 3, 4, 5, 6, 7, 4, 5, 6, 7, 0, 1, 2, 3]
    assert [word & 0xFF for word in words[:16:2]] == list(first)
    assert max(words) < WORD_LIMIT
