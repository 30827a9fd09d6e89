"""The settings that robots and arenas report to observers, as JSON."""

from collections.abc import Mapping

import msgspec

from crcolony.body.settings import CyberRodent
from crcolony.config import Config
from crcolony.protocol.telemetry_messages import MAX_ROBOT_SETTINGS


def settings_as_json(groups: Mapping[str, msgspec.Struct], max_bytes: int) -> str:
    """Return groups of settings as a JSON object of at most `max_bytes`, without the longest groups if necessary."""
    kept = {name: msgspec.json.encode(group) for name, group in groups.items()}
    while (
        len(text := msgspec.json.encode({k: msgspec.Raw(v) for k, v in kept.items()})) > max_bytes
    ):
        del kept[max(kept, key=lambda name: len(kept[name]))]
    return text.decode()


def settings_of_robot(config: Config, body: CyberRodent) -> str:
    """Return the settings that a robot with this body reports."""
    groups = {
        "body": body,
        "learning": config.learning,
        "life": config.life,
        "heredity": config.heredity,
    }
    return settings_as_json(groups, MAX_ROBOT_SETTINGS)
