"""A config is checked as a whole before anything runs, and an error names file, key and reason."""

import tomllib
from pathlib import Path
from typing import get_args

import msgspec
import pytest
import tomli_w

from crcolony.config import Config, ConfigError, check_distributed, load, to_toml, warnings_of
from crcolony.robot.settings import Selection


def test_the_defaults_are_a_config() -> None:
    """Nothing has to be set."""
    assert load() == Config()


def test_a_config_written_and_read_is_the_same(tmp_path: Path) -> None:
    """With every kind of value in it."""
    config = load(
        None,
        [
            "robots=7",
            "selection=central",
            "learning.speeds_m_s=[0.0, 0.1]",
            "arena.pillars=[[0.5, 0.5, 0.1]]",
            "arena.inner_walls=[[0, 0, 1, 1]]",
            "body.noise.distance_m=0.01",
            "learning.shaping=false",
        ],
    )
    path = tmp_path / "config.toml"
    path.write_text(to_toml(config))
    assert load(path) == config


def test_settings_take_precedence_over_the_file_and_the_last_one_counts(tmp_path: Path) -> None:
    """The same key in the file and twice with --set."""
    path = tmp_path / "config.toml"
    path.write_text("robots = 5\n[life]\nagents = 6\n")
    config = load(path, ["life.agents=7", "life.agents=8"])
    assert (config.robots, config.life.agents) == (5, 8)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("robotts = 4", "robotts: there is no such setting"),
        ("[life]\nagent = 4", "life.agent: there is no such setting"),
        ("[body.noise]\ndistance = 0.1", "body.noise.distance: there is no such setting"),
        ("robots = 'four'", "robots: expected `int`, got `str`"),
        ("robots = 2.5", "robots: expected `int`, got `float`"),
        ("robots = 0", "robots: expected `int` >= 1"),
        ("life = 3", "life: expected `object`, got `int`"),
        ("selection = 'fair'", "selection: invalid enum value 'fair'"),
        ("[arena]\nwidth_m = -2.0", "arena.width_m: expected `float` >= 0.0"),
        ("[arena]\nwidth_m = nan", "arena.width_m: expected `float` >= 0.0"),
        ("[arena]\nheight_m = inf", "arena.height_m: expected `float` <= 10000.0"),
        ("[arena]\npacks = 5000", "arena.packs: 5000 do not fit into 4.84 square metres"),
        ("[arena]\nwidth_m = 0.2", "arena.width_m: 0.2 x 0.2 m is too small for a robot"),
        ("[arena]\nwidth_m = 0.5", "robots: 4 do not fit into 0.25 square metres"),
        ("[arena]\npillars = [[0, 0, 3.0]]", "arena.pillars: they cover the whole arena"),
        ("[arena]\npillars = [[0, 0]]", "arena.pillars[0]: expected `array` of length 3, got 2"),
        ("[heredity]\nhighest_lambda = 1.1", "heredity.highest_lambda: expected `float` <= 1.0"),
        ("[heredity]\nhighest_gamma = 2", "heredity.highest_gamma: expected `float` <= 1.0"),
        ("[heredity]\ncrossover = 'three'", "heredity.crossover: invalid enum value 'three'"),
        ("[learning]\nspeeds_m_s = []", "learning: there must be at least one speed and one turn"),
        ("[learning]\nspeeds_m_s = [2.0]", "learning.speeds_m_s: a wheel would turn at 2.08 m/s"),
        ("[learning]\nturns_rad_s = [nan]", "learning.turns_rad_s[0]: expected `float`"),
        ("[body]\ncamera = false", "body.camera: the learning modules need the camera"),
        ("robots = ", "not TOML"),
        ("robots = 1\nrobots = 2", "not TOML"),
    ],
)
def test_an_error_is_one_line(tmp_path: Path, text: str, reason: str) -> None:
    """The message begins with the file, and names key and reason."""
    path = tmp_path / "my.toml"
    path.write_text(text)
    with pytest.raises(ConfigError) as caught:
        load(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert reason in message
    assert "\n" not in message


@pytest.mark.parametrize(
    "setting", ["", "=", "=3", "robots", "robots=4\nseed=2", "life.agents.x=1", "a.b=1"]
)
def test_a_wrong_setting_is_refused_in_one_line(setting: str) -> None:
    """An unknown key, a wrong value, or a text that is not key=value."""
    with pytest.raises(ConfigError) as caught:
        load(None, ["life.agents=3", setting])
    assert "\n" not in str(caught.value)


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    """Missing, a folder, or not a text."""
    binary = tmp_path / "binary"
    binary.write_bytes(b"\xff\xfe\x00")
    for path in (tmp_path / "missing.toml", tmp_path, binary):
        with pytest.raises(ConfigError, match=str(path)):
            load(path)


def test_every_number_has_bounds() -> None:
    """No setting accepts an infinite number."""

    def numbers(kind: type, path: str) -> list[str]:
        found = []
        for field in msgspec.structs.fields(kind):
            value = field.default
            if value is msgspec.NODEFAULT:
                found += numbers(field.type, f"{path}{field.name}.")
            elif isinstance(value, float | int) and not isinstance(value, bool):
                found.append(f"{path}{field.name}")
        return found

    names = numbers(Config, "")
    assert len(names) > 50
    for name in names:
        for value in ("inf", "-inf", "nan"):
            with pytest.raises(ConfigError, match=name):
                load(None, [f"{name}={value}"])


@pytest.mark.parametrize("path", sorted(Path("configs").glob("*.toml")), ids=str)
def test_the_configs_of_the_repository_are_valid(path: Path) -> None:
    """Each differs from the defaults."""
    assert load(path) != Config()


def test_the_config_of_an_earlier_run_means_what_it_meant(tmp_path: Path) -> None:
    """A file that lists all settings of an earlier version has the former values of those that came later."""
    tree = tomllib.loads(to_toml(load(None, ["robots=5"])))
    for group, setting in (
        ("learning", "jaw_modules"),
        ("learning", "visible_mates"),
        ("heredity", "highest_selector"),
    ):
        del tree[group][setting]
    path = tmp_path / "config.toml"
    path.write_text(tomli_w.dumps(tree))
    config = load(path)
    assert config.robots == 5
    assert config.learning.jaw_modules == ("foraging", "mating")
    assert config.learning.visible_mates == "any"
    assert config.heredity.highest_selector == 0.0
    mine = path.rename(tmp_path / "my.toml")
    assert load(mine) == load(None, ["robots=5"])
    path.write_text("robots = 5\n")
    assert load(path) == load(None, ["robots=5"])


@pytest.mark.parametrize("name", ["former_default", "senses"])
def test_the_configs_beside_the_code_are_valid(name: str) -> None:
    """A user starts from them."""
    load(Path(__file__).parents[2] / "configs" / f"{name}.toml")


@pytest.mark.parametrize(("tilings", "is_warned"), [(3, True), (6, True), (9, True), (7, False)])
def test_tilings_that_line_up_are_warned_of(tilings: int, is_warned: bool) -> None:
    """The default is not among them."""
    warnings = warnings_of(load(None, [f"learning.tilings={tilings}"]))
    assert [w.startswith(f"learning.tilings: {tilings} shares a factor") for w in warnings] == (
        [True] if is_warned else []
    )
    assert warnings_of(Config()) == []


@pytest.mark.parametrize("selection", get_args(Selection))
def test_a_way_of_selection_that_robots_as_processes_do_not_know_is_refused(selection: str) -> None:
    """With the reason, and with what they do know."""
    config = Config(selection=selection)  # type: ignore[arg-type]
    if selection in ("implicit", "medea"):
        check_distributed(config)
        return
    with pytest.raises(ConfigError) as error:
        check_distributed(config)
    (line,) = str(error.value).splitlines()
    assert line.startswith(f"config: selection: {selection} is for colonies in one process")
    assert line.endswith("robots as processes know implicit or medea")
