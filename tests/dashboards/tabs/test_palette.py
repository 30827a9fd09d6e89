"""Colours mean the same in every view, and are distinct."""

import itertools

import numpy as np
import pytest
from crcolony_dashboards.tabs import palette
from hypothesis import given
from hypothesis import strategies as st

from tests.support.colour_vision import VISIONS, difference, lab


def distance(one: palette.Colour, other: palette.Colour) -> float:
    return float(np.linalg.norm(np.subtract(one, other)))


def test_energy_goes_from_dark_to_bright() -> None:
    """Values out of range have the colour of the nearer end."""
    low, middle, high = palette.ENERGY
    colours = palette.energy_colours([0.0, 0.5, 1.0, -3.0, 7.0])
    assert [tuple(colour) for colour in colours] == [low, middle, high, low, high]
    assert colours.dtype == np.uint8


@given(st.lists(st.floats(0.0, 1.0), max_size=20))
def test_energy_colours_are_interpolated(energies: list[float]) -> None:
    """Linearly within each half."""
    colours = palette.energy_colours(energies)
    assert colours.shape == (len(energies), 3)
    for energy, colour in zip(energies, colours, strict=True):
        low, high = palette.ENERGY[:2] if energy <= 0.5 else palette.ENERGY[1:]
        share = 2.0 * energy - (energy > 0.5)
        exact = np.array(low) + share * np.subtract(high, low)
        assert np.all(np.abs(colour - exact) <= 1.0)


@pytest.mark.parametrize("vision", VISIONS)
class TestColourVision:
    """What a colour says is seen with and without each kind of cones."""

    def test_energies_are_told_apart_by_brightness(self, vision: str) -> None:
        """A fuller robot is always brighter, and quarters of an energy differ clearly."""
        shades = palette.energy_colours(np.linspace(0.0, 1.0, 21).tolist()).tolist()
        levels: list[palette.Colour] = [(red, green, blue) for red, green, blue in shades]
        brightness = [lab(level, vision)[0] for level in levels]
        assert all(later > earlier for earlier, later in itertools.pairwise(brightness))
        quarters = levels[::5]
        assert all(difference(*pair, vision) > 15.0 for pair in itertools.pairwise(quarters))

    @pytest.mark.parametrize(
        "colours",
        [
            [*palette.MODULES, palette.STALE],
            [palette.PACK, palette.EMPTY_PACK, palette.BACKGROUND],
            [palette.MET, palette.MATED, palette.CONCEIVED],
            [palette.YES, palette.NO, palette.BACKGROUND],
            [palette.ENERGY[0], palette.STALE, palette.BACKGROUND],
        ],
    )
    def test_states_are_told_apart(self, colours: list[palette.Colour], vision: str) -> None:
        """Modules, packs, lines between robots, peers, and a starving robot from a silent one."""
        for one, other in itertools.combinations(colours, 2):
            assert difference(one, other, vision) > 13.0, (one, other)

    def test_the_lines_of_a_chart_are_told_apart(self, vision: str) -> None:
        """The first five, which are as many as a chart of meta-parameters has."""
        for one, other in itertools.combinations(palette.SERIES[:5], 2):
            assert difference(one, other, vision) > 13.0, (one, other)


def test_modules_have_different_colours() -> None:
    """A robot without a module is grey."""
    assert palette.module_colour(0) != palette.module_colour(1)
    assert palette.module_colour(-1) == palette.STALE
    assert palette.module_colour(57) in palette.MODULES


def test_any_number_of_founders_has_colours() -> None:
    """Successive ones differ much, the first hundred are all different, and each keeps its own."""
    colours = [palette.founder_colour(number) for number in range(100)]
    assert len(set(colours)) == 100
    assert all(distance(one, other) > 60.0 for one, other in itertools.pairwise(colours))
    assert [palette.founder_colour(number) for number in range(100)] == colours
    assert all(0 <= part <= 255 for part in palette.founder_colour(10**9))


def test_lines_of_one_plot_have_different_colours() -> None:
    """Up to the number of colours; then they repeat."""
    colours = [palette.series_colour(number) for number in range(8)]
    assert len(set(colours)) == 8
    assert palette.series_colour(8) == colours[0]


def test_empty_arrays_have_the_right_shape() -> None:
    """Of zero colours."""
    assert palette.colour_array([]).shape == palette.energy_colours([]).shape == (0, 3)
    assert palette.colour_array(iter([(1, 2, 3)])).tolist() == [[1, 2, 3]]


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=20))
def test_heat_goes_from_dark_to_bright(values: list[float]) -> None:
    """Higher values are never darker, apart from rounding; equal values have a colour from the middle."""
    shades = palette.heat_map(np.array(values)).astype(int).sum(axis=-1)
    ordered = shades[np.argsort(values)]
    assert all(later >= earlier - 3 for earlier, later in itertools.pairwise(ordered))
    if max(values) - min(values) > 1e-3:
        assert (ordered[0], ordered[-1]) == (68 + 1 + 84, 253 + 231 + 37)
    elif max(values) == min(values):
        assert set(shades) == {33 + 145 + 140}
