"""Names become entity names, and different names remain different."""

import string

import rerun as rr
from crcolony_dashboards.tabs.tab import entity_name
from hypothesis import given
from hypothesis import strategies as st

NAMES = st.text(string.ascii_letters + string.digits + "_.-", min_size=1, max_size=8)
"""Of colonies"""


def test_a_robots_name_is_legible_in_its_entity() -> None:
    """With its colony or without."""
    assert entity_name("#7") == "robot_7"
    assert entity_name("blue #7") == "blue_robot_7"
    assert entity_name("0123abcd/17") == "0123abcd_17"


@given(NAMES, NAMES)
def test_different_colonies_have_different_entities(one: str, other: str) -> None:
    """Rerun accepts them without escaping."""
    assert (entity_name(one) == entity_name(other)) == (one == other)
    assert rr.new_entity_path([entity_name(one)]) == f"/{entity_name(one)}"
