"""What robots and arenas say of their settings is read once; from nonsense comes nothing, and no error."""

import json

import pytest

from crcolony.body.settings import CyberRodent
from crcolony.protocol.telemetry_messages import ArenaMetadata, RobotMetadata
from crcolony.robot.settings import Heredity, Learning
from crcolony.telemetry.peer_settings import Mind, PeerSettings
from tests.support.fake_telemetry import IDS, NATURE, SETTINGS


def robot(text: str) -> RobotMetadata:
    return RobotMetadata(IDS[0], 3, text, [])


def arena(text: str) -> ArenaMetadata:
    return ArenaMetadata("lab", 7, text)


def test_a_robot_says_how_its_genes_are_read() -> None:
    """And much that nobody here needs."""
    message = json.loads(SETTINGS) | {"life": {"agents": 20}}
    message["body"]["camera_range_m"] = 0.75
    assert PeerSettings().of_robot(robot(json.dumps(message))) == Mind(
        CyberRodent(camera_range_m=0.75), Learning(), Heredity()
    )


def test_an_arena_says_what_its_bodies_are_like() -> None:
    """Whether or not it says anything else."""
    message = {"body": {"camera_half_angle_rad": 0.5}}
    assert PeerSettings().of_arena(arena(NATURE)) == CyberRodent()
    assert PeerSettings().of_arena(arena(json.dumps(message))) == CyberRodent(
        camera_half_angle_rad=0.5
    )


@pytest.mark.parametrize(
    "text",
    ["", "{", "[]", "{}", '{"body":{}}', '{"body":{},"learning":{"tilings":-1},"heredity":{}}',
     '{"body":{"wings":2},"learning":{},"heredity":{}}'],
)  # fmt: skip
def test_from_nonsense_comes_nothing(text: str) -> None:
    """No JSON, groups that are missing, numbers out of range, and settings of another program."""
    settings = PeerSettings()
    assert settings.of_robot(robot(text)) is None
    assert settings.of_robot(robot(text)) is None
    assert settings.of_arena(arena(text.replace('"body":{}', '"body":1'))) is None


def test_who_has_said_nothing_has_no_settings() -> None:
    """A robot or an arena that was not asked yet."""
    assert PeerSettings().of_robot(None) is None
    assert PeerSettings().of_arena(None) is None


def test_settings_are_read_once() -> None:
    """Of all who say the same; one text is read for a robot in one way and for an arena in another."""
    settings = PeerSettings()
    first = settings.of_robot(robot(SETTINGS))
    assert settings.of_arena(arena(SETTINGS)) == CyberRodent()
    assert settings.of_robot(RobotMetadata(IDS[1], 4, SETTINGS, [])) is first


def test_endless_nonsense_takes_no_endless_memory() -> None:
    """What was read long ago is read again."""
    settings = PeerSettings()
    first = settings.of_robot(robot(SETTINGS))
    for number in range(1_100):
        settings.of_robot(robot(str(number)))
    assert settings.of_robot(robot(SETTINGS)) == first
    assert settings.of_robot(robot(SETTINGS)) is not first
