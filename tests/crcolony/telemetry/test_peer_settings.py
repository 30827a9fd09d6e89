"""The settings in metadata are decoded once; invalid settings count as none, and raise no error."""

import json

import pytest

from crcolony.body.settings import CyberRodent
from crcolony.protocol.telemetry_messages import ArenaMetadata, RobotMetadata
from crcolony.robot.settings import Heredity, Learning
from crcolony.telemetry.peer_settings import Mind, PeerSettings
from tests.support.fake_telemetry import IDS, NATURE, SETTINGS


def robot(text: str) -> RobotMetadata:
    return RobotMetadata(IDS[0], 3, text, [], "")


def arena(text: str) -> ArenaMetadata:
    return ArenaMetadata("lab", 7, text)


def test_the_metadata_of_a_robot_holds_the_settings_that_decode_its_genes() -> None:
    """Further settings are ignored."""
    message = json.loads(SETTINGS) | {"life": {"agents": 20}}
    message["body"]["camera_range_m"] = 0.75
    assert PeerSettings().of_robot(robot(json.dumps(message))) == Mind(
        CyberRodent(camera_range_m=0.75), Learning(), Heredity()
    )


def test_the_metadata_of_an_arena_holds_the_settings_of_its_bodies() -> None:
    """With or without further settings."""
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
def test_invalid_settings_count_as_none(text: str) -> None:
    """No JSON, missing groups, numbers out of range, and settings of another program."""
    settings = PeerSettings()
    assert settings.of_robot(robot(text)) is None
    assert settings.of_robot(robot(text)) is None
    assert settings.of_arena(arena(text.replace('"body":{}', '"body":1'))) is None


def test_unknown_metadata_has_no_settings() -> None:
    """Of a robot or an arena that has not replied yet."""
    assert PeerSettings().of_robot(None) is None
    assert PeerSettings().of_arena(None) is None


def test_settings_are_decoded_once() -> None:
    """For all robots with the same text; the same text of an arena is decoded on its own."""
    settings = PeerSettings()
    first = settings.of_robot(robot(SETTINGS))
    assert settings.of_arena(arena(SETTINGS)) == CyberRodent()
    assert settings.of_robot(RobotMetadata(IDS[1], 4, SETTINGS, [], "")) is first


def test_the_cache_is_bounded() -> None:
    """Settings that were decoded long ago are decoded again."""
    settings = PeerSettings()
    first = settings.of_robot(robot(SETTINGS))
    for number in range(1_100):
        settings.of_robot(robot(str(number)))
    assert settings.of_robot(robot(SETTINGS)) == first
    assert settings.of_robot(robot(SETTINGS)) is not first
