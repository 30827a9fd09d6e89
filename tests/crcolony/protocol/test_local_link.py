"""Only who has the keys of a link proves to be its end, and only for one robot, one run and one challenge."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from crcolony.protocol.body_messages import LocalLink
from crcolony.protocol.codec import WireError
from crcolony.protocol.identity import seeded
from crcolony.protocol.link_keys import LinkKeys
from crcolony.protocol.local_link import (
    CHALLENGE_BYTES,
    check_body,
    check_robot,
    prove_body,
    prove_robot,
    read_claim,
)

KEYS, OTHER_KEYS = LinkKeys(bytes(32), b"a" * 32), LinkKeys(b"b" * 32, b"c" * 32)
ROBOT, OTHER_ROBOT = (seeded("test", 1, number).id for number in range(2))
LINK = LocalLink(ROBOT, 7, bytes(CHALLENGE_BYTES))
OTHERS = [
    LocalLink(OTHER_ROBOT, 7, bytes(CHALLENGE_BYTES)),
    LocalLink(ROBOT, 8, bytes(CHALLENGE_BYTES)),
    LocalLink(ROBOT, 7, b"x" * CHALLENGE_BYTES),
]


def test_both_ends_believe_each_other() -> None:
    """The robot proves itself first, and then the body's process."""
    proof = prove_robot(LINK, KEYS)
    assert read_claim(proof) == LINK
    check_robot(proof, LINK, KEYS)
    check_body(prove_body(LINK, KEYS), LINK, KEYS)


def test_a_proof_is_not_its_own_answer() -> None:
    """Who sends back what it has received has proved nothing."""
    with pytest.raises(WireError):
        check_body(prove_robot(LINK, KEYS), LINK, KEYS)
    with pytest.raises(WireError):
        check_robot(prove_body(LINK, KEYS), LINK, KEYS)


def test_other_keys_prove_nothing() -> None:
    """Those of another link, or of none."""
    with pytest.raises(WireError):
        check_robot(prove_robot(LINK, OTHER_KEYS), LINK, KEYS)
    with pytest.raises(WireError):
        check_body(prove_body(LINK, OTHER_KEYS), LINK, KEYS)


@pytest.mark.parametrize("other", OTHERS, ids=["robot", "run", "challenge"])
def test_a_proof_holds_for_one_link(other: LocalLink) -> None:
    """Neither for another robot, nor another run, nor once more later: each challenge is drawn anew."""
    with pytest.raises(WireError):
        check_robot(prove_robot(other, KEYS), LINK, KEYS)
    with pytest.raises(WireError):
        check_body(prove_body(other, KEYS), LINK, KEYS)


@given(st.binary(max_size=200))
def test_noise_is_refused(noise: bytes) -> None:
    """With the error that every reader handles."""
    with pytest.raises(WireError):
        check_robot(noise, LINK, KEYS)
    with pytest.raises(WireError):
        check_body(noise, LINK, KEYS)
    with pytest.raises(WireError):
        read_claim(noise)


@given(st.integers(0, len(prove_robot(LINK, KEYS)) - 1), st.integers(1, 255))
def test_a_proof_with_another_byte_is_refused(at: int, change: int) -> None:
    """Wherever it is."""
    proof = bytearray(prove_robot(LINK, KEYS))
    proof[at] ^= change
    with pytest.raises(WireError):
        check_robot(bytes(proof), LINK, KEYS)
