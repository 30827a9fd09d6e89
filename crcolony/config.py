"""The config of a colony: read from a TOML file and `--set key=value`, checked as a whole, frozen."""

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
import tomli_w
from msgspec import Meta

from crcolony.body.settings import WHEEL_LIMIT_M_S, CyberRodent
from crcolony.errors import CrcolonyError
from crcolony.robot.settings import Heredity, Learning, Life
from crcolony.world.arena_size import check_fit
from crcolony.world.settings import ArenaSettings


class ConfigError(CrcolonyError):
    """A setting is wrong: the message names the file, the key and the reason."""


class Config(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """All settings that determine a colony's history."""

    robots: Annotated[int, Meta(ge=1, le=10_000)] = 4
    generations: Annotated[int, Meta(ge=0, le=1_000_000)] = 250
    """Generations to run; 0: until stopped"""
    seed: Annotated[int, Meta(ge=0, le=2**62)] = 1
    selection: Literal["implicit", "central"] = "implicit"
    """`central` is the baseline: one population, and roulette on the number of matings"""
    arena: ArenaSettings = msgspec.field(default_factory=ArenaSettings)
    body: CyberRodent = msgspec.field(default_factory=CyberRodent)
    learning: Learning = msgspec.field(default_factory=Learning)
    life: Life = msgspec.field(default_factory=Life)
    heredity: Heredity = msgspec.field(default_factory=Heredity)


def load(path: Path | None = None, settings: Sequence[str] = ()) -> Config:
    """Read a config from a file (or the defaults), with `key=value` settings that take precedence.

    Raises ConfigError, with a message of one line, for a file that cannot be read, TOML that cannot be parsed, an
    unknown key, a wrong type, a value out of range, or values that are impossible together.
    """
    name = str(path) if path else "defaults"
    tree = _read(path) if path else {}
    for setting in settings:
        _insert(tree, setting)
    if settings:
        name += " with --set"
    try:
        config = msgspec.convert(tree, Config)
    except msgspec.ValidationError as error:
        raise ConfigError(f"{name}: {_format_error(str(error))}") from None
    check_config(config, name)
    return config


def check_config(config: Config, name: str = "config") -> None:
    """Raise ConfigError for values that are impossible together."""
    try:
        check_fit(config.arena, config.body, config.robots)
    except ValueError as error:
        raise ConfigError(f"{name}: {error}") from None
    if not config.learning.speeds_m_s or not config.learning.turns_rad_s:
        raise ConfigError(f"{name}: learning: there must be at least one speed and one turn")
    half_track_m = 0.5 * config.body.track_m
    fastest = max(map(abs, config.learning.speeds_m_s)) + half_track_m * max(
        map(abs, config.learning.turns_rad_s)
    )
    if fastest > WHEEL_LIMIT_M_S:
        raise ConfigError(
            f"{name}: learning.speeds_m_s: a wheel would turn at {fastest:.2f} m/s,"
            f" the limit is {WHEEL_LIMIT_M_S}"
        )
    if not config.body.camera:
        raise ConfigError(f"{name}: body.camera: the learning modules need the camera")


def to_toml(config: Config) -> str:
    """Return a config as TOML that `load` reads back to an equal one."""
    return tomli_w.dumps(msgspec.to_builtins(config))


def _read(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text("utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: not TOML: {error}") from None
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}") from None


def _insert(tree: dict[str, Any], setting: str) -> None:
    """Insert one `key.path=value` into the tree; the value is parsed as TOML, or is a plain text if that fails."""
    key, equals, text = setting.partition("=")
    key, text = key.strip(), text.strip()
    if not equals or not key or "\n" in setting:
        raise ConfigError(f"--set {setting!r}: expected key=value, as in life.agents=10")
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        value = text
    *groups, last = key.split(".")
    for group in groups:
        tree = tree.setdefault(group, {})
        if not isinstance(tree, dict):
            raise ConfigError(f"--set {setting}: {group} is not a group of settings")
    tree[last] = value


def _format_error(message: str) -> str:
    """Return msgspec's "Expected … - at `$.a.b`" as "a.b: expected …"."""
    reason, _, place = message.partition(" - at ")
    place = place.strip("`").removeprefix("$").removeprefix(".")
    if reason.startswith("Object contains unknown field"):
        unknown = reason.split("`")[1]
        return f"{f'{place}.' if place else ''}{unknown}: there is no such setting"
    return f"{place or 'config'}: {reason[0].lower()}{reason[1:]}"
