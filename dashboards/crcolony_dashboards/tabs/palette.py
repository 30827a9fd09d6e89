"""The colours of the dashboard, the same in every view, distinct for the colour-blind too (Okabe and Ito, 2008)."""

import colorsys
import functools
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

Colour = tuple[int, int, int]
Colours = NDArray[np.uint8]
"""(n, 3) red, green, blue from 0 to 255"""

BACKGROUND: Colour = (18, 20, 26)
INK: Colour = (222, 226, 230)
SOFT: Colour = (173, 181, 189)
"""Of numbers and notes"""
DIM: Colour = (108, 117, 125)
FAINT: Colour = (44, 50, 58)
STALE: Colour = (95, 99, 104)
"""Robots without a recent state"""
MODULES: tuple[Colour, ...] = ((86, 180, 233), (204, 121, 167))
"""Of the learning modules foraging and mating"""
CONCEIVED: Colour = (255, 255, 255)
"""A mating by which at least one of the robots conceived"""
MATED: Colour = (204, 121, 167)
MET: Colour = DIM
PACK: Colour = (240, 228, 66)
EMPTY_PACK: Colour = (70, 66, 30)
YES: Colour = (86, 180, 233)
NO: Colour = (213, 94, 0)
ENERGY: tuple[Colour, ...] = ((94, 60, 153), (36, 140, 141), (253, 231, 37))
"""From starving to full, and brighter all the way, so that it does not depend on hue"""
SERIES: tuple[Colour, ...] = (
    (86, 180, 233),
    (230, 159, 0),
    (0, 158, 115),
    (204, 121, 167),
    (240, 228, 66),
    (0, 114, 178),
    (213, 94, 0),
    (190, 190, 190),
)
"""Of the lines of one plot, in order"""

_GOLDEN = 0.618033988749895


def energy_colours(energies: Sequence[float]) -> Colours:
    """Return the colours of energies from 0 (starving, dark) to 1 (full, bright), (n, 3)."""
    return _interpolated(np.clip(np.asarray(energies, dtype=float), 0.0, 1.0), ENERGY)


def module_colour(module: int) -> Colour:
    """Return the colour of a learning module by its number; grey if it is negative, for a robot without one."""
    return MODULES[module % len(MODULES)] if module >= 0 else STALE


def series_colour(number: int) -> Colour:
    """Return the colour of the n-th line of a plot."""
    return SERIES[number % len(SERIES)]


@functools.cache
def founder_colour(number: int) -> Colour:
    """Return the colour of the n-th founder, for any n; successive ones differ strongly."""
    hue = (0.58 + number * _GOLDEN) % 1.0
    value = 0.95 - 0.4 * (number % 3) / 2.0
    red, green, blue = colorsys.hsv_to_rgb(hue, 0.65, value)
    return round(255 * red), round(255 * green), round(255 * blue)


def colour_array(colours: Iterable[Colour]) -> Colours:
    """Return colours as an array, (n, 3)."""
    return np.array(list(colours), dtype=np.uint8).reshape(-1, 3)


VIRIDIS: tuple[Colour, ...] = (
    (68, 1, 84),
    (59, 82, 139),
    (33, 145, 140),
    (94, 201, 98),
    (253, 231, 37),
)
"""Of heat maps, from the lowest value to the highest"""


def heat_map(values: NDArray[np.float64]) -> Colours:
    """Return values as colours from dark (the lowest) to bright (the highest), (..., 3)."""
    low, high = float(values.min()), float(values.max())
    levels = (values - low) / (high - low) if high > low else np.full(values.shape, 0.5)
    return _interpolated(levels, VIRIDIS)


def _interpolated(levels: NDArray[np.float64], stops: Sequence[Colour]) -> Colours:
    """Return the colours of levels from 0 to 1 between evenly spaced stops, (..., 3)."""
    places, colours = np.linspace(0.0, 1.0, len(stops)), np.array(stops, dtype=float)
    parts = [np.interp(levels, places, colours[:, k]) for k in range(3)]
    return np.stack(parts, axis=-1).astype(np.uint8)


def dimmed(colour: Colour) -> Colour:
    """Return a darker shade of a colour, for what belongs to it."""
    red, green, blue = (round(0.6 * part) for part in colour)
    return red, green, blue
