"""A sweep has a condition for every combination of values, and refuses what is none."""

from pathlib import Path

import pytest

from crcolony.config import ConfigError, load
from crcolony.experiments.framework.setting_sweep import sweep_conditions


def test_every_combination_is_a_condition() -> None:
    """In order, the last sweep fastest; a list is one value, and what is set is set in all of them."""
    sweeps = ["life.agents=3, 4", "learning.speeds_m_s=[0.1,0.2],[0.3]"]
    found = sweep_conditions(None, ["robots=2"], sweeps)
    assert list(found) == [
        "life.agents=3 learning.speeds_m_s=[0.1,0.2]",
        "life.agents=3 learning.speeds_m_s=[0.3]",
        "life.agents=4 learning.speeds_m_s=[0.1,0.2]",
        "life.agents=4 learning.speeds_m_s=[0.3]",
    ]
    expected = load(None, ["robots=2", "life.agents=4", "learning.speeds_m_s=[0.3]"])
    assert list(found.values())[3] == expected


def test_the_config_of_a_file_is_that_of_all_conditions(tmp_path: Path) -> None:
    """A sweep takes precedence over it."""
    (tmp_path / "my.toml").write_text("robots = 3\ngenerations = 7\n")
    found = sweep_conditions(tmp_path / "my.toml", [], ["robots=2,5"])
    assert [(config.robots, config.generations) for config in found.values()] == [(2, 7), (5, 7)]


@pytest.mark.parametrize(
    ("sweeps", "line"),
    [
        (["life.agents"], "expected key=value,value"),
        (["=3"], "expected key=value,value"),
        (["life.agents=3,,4"], "expected key=value,value"),
        (["life.agents=3,x"], "life.agents: expected `int`, got `str`"),
        (["life.agents=3", "life.agents=4"], "life.agents: is swept twice"),
        (["life.agents=3,3"], "life.agents=3: is there twice"),
        (["seed=1,2"], "every condition has the seeds of --seeds"),
        (["selection=a/b"], "cannot be the name of a folder"),
        ([f"selection={'x' * 300}"], "cannot be the name of a folder"),
    ],
)
def test_what_is_no_sweep_is_refused_in_one_line(sweeps: list[str], line: str) -> None:
    """With what is wrong."""
    with pytest.raises(ConfigError) as refused:
        sweep_conditions(None, [], sweeps)
    assert line in str(refused.value)
    assert "\n" not in str(refused.value)
