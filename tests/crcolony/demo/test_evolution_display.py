"""What evolves is shown while it evolves: in one line that changes, or in plain lines."""

import io

import pytest
from rich.console import Console

from crcolony.demo.evolution_display import EvolutionDisplay, evolved, format_matings, sparkline
from tests.support.small_colony import live, new_colony


def test_bars_rise_from_nothing_to_the_highest() -> None:
    """One a value, or the mean of several where there are too many."""
    assert sparkline([0.0, 1.0, 7.0]) == "▁▂█"
    assert sparkline([0.0, 0.0]) == "▁▁"
    assert sparkline([0.0, 2.0, 6.0, 8.0], width=2) == "▂█"
    assert len(sparkline([float(k) for k in range(1000)])) == 40


def test_first_and_last_generations_are_compared() -> None:
    """The last ones by their mean: a single generation varies."""
    assert format_matings([]) == "no generation has ended yet"
    assert format_matings([0.25, 7.0]).startswith("matings an agent 0.2 → 3.6  ▁█")
    assert evolved([0.0, *5 * [2.0]]) == 2.0


@pytest.mark.parametrize("is_terminal", [True, False])
def test_the_last_state_stays_on_the_screen(is_terminal: bool) -> None:
    """With every generation that has ended."""
    text = io.StringIO()
    console = Console(file=text, force_terminal=is_terminal, width=100, highlight=False)
    display = EvolutionDisplay(console)
    colony, _ = new_colony()
    colony.start()
    with display.show():
        display.show_compiling(1, 4)
        for generation in range(1, 4):
            live(colony, generation)
            display.show_progress(colony, 12.0)
        display.show_end(colony)
    assert len(display.matings) == 3
    last = text.getvalue().rpartition("generation ")[2]
    assert last.startswith(f"3: {format_matings(display.matings)}")
    assert "compiling, which is done once: 25%" in text.getvalue()


def test_plain_lines_are_few() -> None:
    """The first generation, one every few seconds, and the end."""
    text = io.StringIO()
    display = EvolutionDisplay(Console(file=text, width=100))
    colony, _ = new_colony()
    colony.start()
    live(colony, 1)
    for _ in range(50):
        display.show_progress(colony, 12.0)
    assert len(text.getvalue().splitlines()) == 1
