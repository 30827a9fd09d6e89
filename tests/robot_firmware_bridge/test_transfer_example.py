"""The example that lets evolved agents live in e-pucks runs, in the simulator of their makers."""

import importlib.util
from types import ModuleType

import numpy as np
import pytest

from crcolony.config import Config
from crcolony.robot.factory import make_robots, numbered_streams
from tests.robot_firmware_bridge.playground import needs_playground
from tests.support.paths import ROOT


@pytest.fixture(scope="module")
def example() -> ModuleType:
    """The example as a module."""
    path = ROOT / "examples/transfer_to_epuck.py"
    spec = importlib.util.spec_from_file_location("transfer_to_epuck", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@needs_playground
def test_a_robot_lives_in_an_epuck(example: ModuleType) -> None:
    """It steps in every control period, and what it takes from feeders is counted."""
    config = Config()
    batch, _, (robot,) = make_robots(config, ["0"], numbered_streams(1, 0, 1))
    robot.start()
    taken = example.live((robot, batch, config), 40)
    assert taken.shape == (40,)
    assert (taken >= 0.0).all()
    assert robot.steps == 40


def test_its_report_compares_in_pairs(
    example: ModuleType, capsys: pytest.CaptureFixture[str]
) -> None:
    """Learners that always take more than the others are better in all pairs."""
    policy, more, founder = np.random.default_rng(1).uniform(0.0, 0.1, (3, 20, 40))
    example.report({"learner": policy + more, "policy": policy, "founder": founder})
    lines = capsys.readouterr().out.splitlines()
    assert lines[3].startswith("learner - policy, whole life: +")
    assert "n = 20, better in 100% of pairs" in lines[3]
    assert lines[5].startswith("learner - founder, whole life: ")
