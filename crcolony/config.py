"""The config of a colony: read from a TOML file and `--set key=value`, checked as a whole, frozen."""

import codecs
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any, get_args

import msgspec
import tomli_w
from msgspec import Meta

from crcolony.body.settings import WHEEL_LIMIT_M_S, CyberRodent
from crcolony.errors import CrcolonyError, did_you_mean
from crcolony.learning.features import distinct_offsets
from crcolony.robot.settings import Heredity, Learning, Life, Selection
from crcolony.world.arena_size import check_fit
from crcolony.world.settings import ArenaSettings

_MAX_BYTES = 2**20
"""Size of a config file, at most; all settings with their comments take 12 kB."""


CONFIG_FILE = "config.toml"
"""Name of the config that a run writes into its folder, with every setting there is."""


class ConfigError(CrcolonyError):
    """A setting is wrong: the message names the file, the key and the reason."""


class Config(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """All settings that determine a colony's history."""

    robots: Annotated[int, Meta(ge=1, le=10_000)] = 4
    """Robots in the arena, and its slots for bodies."""
    generations: Annotated[int, Meta(ge=0, le=1_000_000)] = 250
    """Generations to run; 0: until stopped."""
    seed: Annotated[int, Meta(ge=0, le=2**62)] = 1
    """Seed of all random numbers: the same seed gives the same history."""
    selection: Selection = "implicit"
    """How robots reproduce: by mating (implicit), or to compare with it in another way of the field
    (docs/schemes.md). `central` is the baseline: one population, and roulette on the number of
    matings."""
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
    if (
        path is not None
        and path.name == CONFIG_FILE
        and tree.keys() >= set(Config.__struct_fields__)
    ):
        _complete(tree)
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


ONLY_IN_PROCESS: dict[Selection, str] = {
    **dict.fromkeys(("central", "ompac", "gpbt_pl"), "it compares the agents of all robots"),
    "pgta": "robots send their whole genotypes, whatever their energy",
    "pega": "robots do not tell each other how fit they are",
}
"""Ways of selection that robots as processes do not know, and why."""


def check_distributed(config: Config, name: str = "config") -> None:
    """Raise ConfigError for a way of selection that is for colonies in one process."""
    reason = ONLY_IN_PROCESS.get(config.selection)
    if reason is not None:
        known = " or ".join(one for one in get_args(Selection) if one not in ONLY_IN_PROCESS)
        raise ConfigError(
            f"{name}: selection: {config.selection} is for colonies in one process (crcolony evolve), since {reason};"
            f" robots as processes know {known}"
        )


def warnings_of(config: Config) -> list[str]:
    """Return what is possible in a config, but hardly meant: a line each, with key and remedy."""
    tilings = config.learning.tilings
    offsets = distinct_offsets(tilings, axis=1)
    if offsets == tilings:
        return []
    return [
        f"learning.tilings: {tilings} shares a factor with 3, the multiple by which tilings are displaced along the"
        f" bearing: {offsets * config.learning.bearing_tiles} bearings are told apart instead of"
        f" {tilings * config.learning.bearing_tiles}; use {tilings - 1} or {tilings + 1}"
    ]


def to_toml(config: Config) -> str:
    """Return a config as TOML that `load` reads back to an equal one."""
    return tomli_w.dumps(msgspec.to_builtins(config))


_BEFORE_THEY_EXISTED: dict[str, dict[str, Any]] = {
    "learning": {"jaw_modules": ["foraging", "mating"], "visible_mates": "any"},
    "heredity": {"highest_selector": 0.0},
}
"""What a colony of an earlier version did, in whose config these settings are missing."""


def _complete(tree: dict[str, Any]) -> None:
    """Complete the config of a run that an earlier version wrote: it lists all settings that there were then."""
    for group, former in _BEFORE_THEY_EXISTED.items():
        if isinstance(tree[group], dict):
            tree[group] = former | tree[group]


def setting_types(
    kind: type[msgspec.Struct] = Config, group: str = ""
) -> Iterator[tuple[str, Any]]:
    """Yield key and type of every setting, as in `life.agents`, each group before its settings."""
    for field in msgspec.structs.fields(kind):
        yield f"{group}{field.name}", field.type
        if is_group(field.type):
            yield from setting_types(field.type, f"{group}{field.name}.")


def is_group(kind: Any) -> bool:
    """Return whether a type is that of a group of settings."""
    return isinstance(kind, type) and issubclass(kind, msgspec.Struct)


def _read(path: Path) -> dict[str, Any]:
    try:
        with path.open("rb") as file:
            content = file.read(_MAX_BYTES + 1)
    except (OSError, ValueError) as error:  # ValueError: no system has such a path
        raise ConfigError(
            f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}"
        ) from None
    if len(content) > _MAX_BYTES:
        raise ConfigError(f"{path}: not a config: larger than {_MAX_BYTES // 1024} kB")
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        raise ConfigError(f"{path}: the text is UTF-16; save it as UTF-8")
    try:
        return _parse(content.decode("utf-8-sig"))  # editors of Windows write a byte order mark
    except ValueError as error:
        raise ConfigError(f"{path}: not TOML: {error}") from None


def _parse(text: str) -> dict[str, Any]:
    """Parse TOML; raises ValueError, for numbers that are too long and tables that are too deep as well."""
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("nested too deeply") from None


def _insert(tree: dict[str, Any], setting: str) -> None:
    """Insert one `key.path=value` into the tree; the value is parsed as TOML, or is a plain text if that fails."""
    key, equals, text = setting.partition("=")
    key, text = key.strip(), text.strip()
    if not equals or not key or "\n" in setting:
        raise ConfigError(f"--set {setting!r}: expected key=value, as in life.agents=10")
    try:
        value = _parse(f"value = {text}")["value"]
    except ValueError:
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
    types = dict(setting_types())
    if reason.startswith("Object contains unknown field"):
        key = f"{f'{place}.' if place else ''}{reason.split('`')[1]}"
        name = key.rpartition(".")[2]
        near = [other for other in types if name in other]
        hint = did_you_mean(key, near, least=0.0) or did_you_mean(key, types)
        return f"{key}: there is no such setting{hint}"
    if reason.startswith("Invalid enum value"):
        reason += f"; choose one of {', '.join(get_args(types[place]))}"
    return f"{place or 'config'}: {reason[0].lower()}{reason[1:]}"
