"""The settings that robots and arenas report are JSON, and fit into a message."""

import json

import msgspec

from crcolony.body.settings import CyberRodent
from crcolony.config import load
from crcolony.nodes.reported_settings import settings_as_json, settings_of_robot
from crcolony.protocol.telemetry_messages import MAX_ROBOT_SETTINGS


def test_every_group_is_reported_as_in_the_config() -> None:
    """Any JSON library reads it."""
    config = load()
    groups = json.loads(settings_of_robot(config, CyberRodent(camera_range_m=0.5)))
    assert set(groups) == {"body", "learning", "life", "heredity"}
    assert groups["body"]["camera_range_m"] == 0.5
    assert groups["life"] == msgspec.to_builtins(config.life)


def test_a_group_that_does_not_fit_is_left_out() -> None:
    """A thousand speeds do not keep a robot from reporting the rest."""
    config = load(None, [f"learning.speeds_m_s={[0.1 + k / 1e5 for k in range(1500)]}"])
    text = settings_of_robot(config, config.body)
    assert set(json.loads(text)) == {"body", "life", "heredity"}
    assert len(text) <= MAX_ROBOT_SETTINGS
    assert settings_as_json({"life": config.life}, 2) == "{}"
