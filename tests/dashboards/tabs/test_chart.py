"""A chart has round numbers on its axes, every line its name, and no name hides another."""

import itertools

import numpy as np
import pytest
from crcolony_dashboards.tabs.chart import Chart, Line, format_number, spread_out, ticks
from hypothesis import given
from hypothesis import strategies as st

from tests.support.drawn import RecordingStreams

FINITE = st.floats(-1e6, 1e6)


@given(FINITE, st.floats(0.0, 1e6))
def test_numbers_of_an_axis_enclose_its_values(low: float, size: float) -> None:
    """They are few and evenly spaced."""
    numbers = ticks(low, low + size)
    assert 2 <= len(numbers) <= 8
    tolerance = 1e-6 * max(1.0, abs(low), size)
    assert numbers[0] <= low + tolerance
    assert numbers[-1] >= low + size - tolerance
    steps = np.diff(numbers)
    assert np.allclose(steps, steps[0], rtol=1e-3)


@given(st.integers(0, 10_000), st.integers(0, 10_000))
def test_generations_on_an_axis_are_whole(first: int, count: int) -> None:
    """From the first generation to the last."""
    numbers = ticks(float(first), float(first + count), is_whole=True)
    assert (numbers[0], numbers[-1]) == (first, max(first + count, first + 1))
    assert all(number == int(number) for number in numbers)
    assert all(later > earlier for earlier, later in itertools.pairwise(numbers))
    assert len(numbers) <= 7


@given(st.lists(st.floats(-1.0, 0.0), max_size=8))
def test_names_keep_apart_and_in_order(heights: list[float]) -> None:
    """The view's y axis points down: names move upwards only."""
    moved = spread_out(heights, 0.1)
    assert all(new <= old for new, old in zip(moved, heights, strict=True))
    gaps = np.diff(sorted(moved))
    assert np.all(gaps >= 0.1 - 1e-9)
    for (one, old), (two, older) in itertools.combinations(enumerate(heights), 2):
        assert old == older or (moved[one] < moved[two]) == (old < older)


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (0.204, "0.2"), (-0.001, "0"), (12.34, "12.3"), (1234.5, "1,234"), (7.0, "7")],
)
def test_numbers_are_short(value: float, text: str) -> None:
    """As a person reads them."""
    assert format_number(value) == text


def drawn(lines: list[Line], message: str = "", top: float | None = None) -> RecordingStreams:
    streams = RecordingStreams()
    Chart("/chart", "Title", 2.0, 200.0, top).draw(streams, lines, message)
    return streams


def line(*values: float, name: str = "matings") -> Line:
    return Line(name, (1, 2, 3), np.column_stack([np.arange(len(values)), values]))


class TestDrawing:
    """What stands on the picture."""

    def test_lines_are_scaled_to_the_axes(self) -> None:
        """Zero is at the bottom, the axis' highest number at the top."""
        streams = drawn([line(0.0, 5.0, 10.0)])
        (strip,) = streams.shown("/chart/lines", "strips")
        assert strip == [[0.0, 0.0], [1.0, -0.5], [2.0, -1.0]]
        assert streams.shown("/chart/names", "labels") == ["matings 10"]
        assert "generation" in streams.shown("/chart/numbers", "labels")

    def test_a_fixed_axis_grows_only_for_what_is_above_it(self) -> None:
        """Energies have the axis from 0 to 1."""
        (strip,) = drawn([line(0.2, 0.5)], top=1.0).shown("/chart/lines", "strips")
        assert strip[1] == [2.0, -0.5]
        (strip,) = drawn([line(0.2, 2.0)], top=1.0).shown("/chart/lines", "strips")
        assert strip[1] == [2.0, -1.0]

    def test_a_line_without_a_name_has_no_label(self) -> None:
        """It belongs to another one."""
        streams = drawn([line(1.0, 2.0, name=""), line(1.0, 1.0)])
        assert streams.shown("/chart/names", "labels") == ["matings 1"]
        assert len(streams.shown("/chart/lines", "strips")) == 2

    def test_a_message_stands_in_place_of_lines(self) -> None:
        """And is removed when there are some; lines of nothing but gaps are none."""
        streams = drawn([line(np.nan, np.nan)], "wait")
        assert streams.shown("/chart/message", "labels") == ["wait"]
        chart = Chart("/chart", "Title", 2.0, 200.0)
        chart.draw(streams, [line(1.0, 2.0)], "wait")
        assert streams.shown("/chart/message", "labels") == []
        chart.draw(streams, [], "again")
        assert streams.entities("/chart") == ["/message"]


NUMBERS = st.sampled_from(
    [0.0, -1.0, 1e9, -1e300, 1e300, float("inf"), -float("inf"), float("nan")]
)


@given(st.lists(NUMBERS, min_size=1, max_size=4), st.sampled_from([None, 1.0]))
def test_any_number_can_be_drawn(values: list[float], top: float | None) -> None:
    """Any peer can publish it; no label is long."""
    streams = drawn([line(*values)], "wait", top)
    labels = streams.shown("/chart/names", "labels") + streams.shown("/chart/numbers", "labels")
    assert all(len(text) < 25 for text in labels)
