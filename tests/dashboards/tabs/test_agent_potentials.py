"""The picture of a potential has a scale."""

import itertools

import numpy as np
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.tabs.agent_potentials import heat_map_with_scale


def test_a_potential_is_drawn_with_a_colour_bar() -> None:
    """The potential has large distances at the top, and the bar the highest value."""
    values = np.random.default_rng(1).normal(size=(61, 61))
    picture = heat_map_with_scale(values)
    assert np.array_equal(picture[:, :61], palette.heat_map(values[::-1]))
    bar = picture[:, -1]
    assert tuple(bar[0]) == palette.VIRIDIS[-1]
    assert tuple(bar[-1]) == palette.VIRIDIS[0]
    brightness = bar.astype(int).sum(axis=-1)
    assert all(later <= earlier + 3 for earlier, later in itertools.pairwise(brightness))
    assert tuple(picture[30, 62]) == palette.BACKGROUND
