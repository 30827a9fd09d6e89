"""Any peer can declare any key: what is parsed from one is well-formed, or None."""

import pytest

from crcolony.protocol import key_expressions
from crcolony.protocol.codec import VERSION
from crcolony.protocol.key_expressions import ArenaKeys, ArenaToken, ColonyKeys, RobotToken

ROBOT = bytes(range(16))
ALIVE = f"crcolony/{VERSION}/colony/ours/alive"


def test_the_token_of_a_robot_is_parsed_as_it_was_made() -> None:
    """It contains colony, robot, incarnation and session."""
    token = key_expressions.parse_robot_token(ColonyKeys("ours").alive(ROBOT, 7, "a1b2"))
    assert token == RobotToken("ours", ROBOT, 7, "a1b2")


def test_the_token_of_an_arena_is_parsed_as_it_was_made() -> None:
    """It contains arena, arena run and session."""
    token = key_expressions.parse_arena_token(ArenaKeys("here").alive(2**61, "a1b2"))
    assert token == ArenaToken("here", 2**61, "a1b2")


@pytest.mark.parametrize(
    "key",
    [
        f"{ALIVE}/{ROBOT.hex()}/{2**32}/session",
        f"{ALIVE}/{ROBOT.hex()}/-1/session",
        f"{ALIVE}/{ROBOT.hex()}/²/session",
        f"{ALIVE}/{ROBOT.hex()}/{'9' * 5000}/session",
        f"{ALIVE}/{ROBOT.hex()}/one/session",
        f"{ALIVE}/{ROBOT.hex()[:-2]}/1/session",
        f"{ALIVE}/no-robot/1/session",
        f"{ALIVE}/{ROBOT.hex()}/1",
        f"crcolony/{VERSION}/arena/here/alive/{2**62}/session",
        f"crcolony/{VERSION}/arena/here/alive/²/session",
        f"crcolony/{VERSION}/observer/session",
        "something/else",
        "",
    ],
    ids=lambda key: key[-40:],
)
def test_other_keys_are_no_tokens(key: str) -> None:
    """Numbers are too large, too long, or of another script; robots are no ids; parts are missing."""
    assert key_expressions.parse_robot_token(key) is None
    assert key_expressions.parse_arena_token(key) is None


def test_a_token_of_another_version_is_that_of_an_incompatible_peer() -> None:
    """A token of this version is not, nor is one without a version."""

    def alive(version: str) -> str:
        return f"crcolony/{version}/colony/ours/alive/{ROBOT.hex()}/1/session"

    assert key_expressions.parse_incompatible_peer(alive("99")) == (ROBOT, 99)
    for version in (str(VERSION), "²", "9" * 5000, "new"):
        assert key_expressions.parse_incompatible_peer(alive(version)) is None
