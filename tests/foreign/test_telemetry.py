"""The foreign robot signs what it tells observers as the golden vectors are signed."""

import pytest

from tests.foreign.messages import RefusedError
from tests.foreign.telemetry import opened, signed
from tests.foreign.test_messages import KEY, vector
from tests.vectors.make import COLONY, FOLDER

STATE = (FOLDER / "telemetry_state.bytes").read_bytes()


def test_it_signs_the_state_of_the_vectors() -> None:
    """Byte for byte: Ed25519 has one signature for one text."""
    assert signed(vector("state"), KEY, COLONY, 3 * 2**32 + 7) == STATE


def test_it_opens_what_is_signed_and_refuses_everything_else() -> None:
    """Of another colony, of an arena, changed, or without a signature."""
    assert opened(STATE, COLONY) == (vector("state"), bytes(KEY.verify_key))
    scene = (FOLDER / "telemetry_scene.bytes").read_bytes()
    for payload, colony in (
        (STATE, "another"),
        (scene, "lab"),
        (b"\x00" + STATE[1:], COLONY),
        (vector("state"), COLONY),
        (STATE[-104:], COLONY),
    ):
        with pytest.raises(RefusedError):
            opened(payload, colony)
