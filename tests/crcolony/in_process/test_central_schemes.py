"""Each setting of `selection` is a scheme that sees all robots, or is none."""

from typing import get_args

import pytest

from crcolony.in_process.central_schemes import make_central_scheme
from crcolony.in_process.central_selection import CentralSelection
from crcolony.in_process.lamarckian_selection import LamarckianSelection
from crcolony.robot.genes import agent_schema
from crcolony.robot.settings import Selection
from tests.support.small_colony import small

CENTRAL = {
    "central": CentralSelection,
    "ompac": LamarckianSelection,
    "gpbt_pl": LamarckianSelection,
}


@pytest.mark.parametrize("selection", get_args(Selection))
def test_only_central_schemes_see_all_robots(selection: str) -> None:
    """The others are strategies of single robots."""
    config = small(f"selection={selection}")
    scheme = make_central_scheme(config, agent_schema(config.learning, config.heredity))
    assert type(scheme) is CENTRAL.get(selection, type(None))
