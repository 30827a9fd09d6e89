"""A demo ends with three sentences: what evolved, who mated with whom, and where it is."""

from pathlib import Path

import pytest

from crcolony.demo.closing import say_what_evolved, say_where, say_who_mated
from crcolony.evolution.history import Mated
from crcolony.results.merged_history import MergedHistory


def mated(robot: int, partner: int) -> Mated:
    return Mated(5, robot, partner, f"{robot}/0", f"{partner}/0", 0.5, 0.5, True, False)


@pytest.mark.parametrize(
    ("matings", "sentence"),
    [
        ([], "Evolution had no time: not even two generations ended."),
        ([0.3], "Evolution had no time: not even two generations ended."),
        ([0.3, 1.0, *5 * [7.0]], "In 7 generations matings an agent went from 0.3 to 7.0."),
    ],
)
def test_the_first_says_what_evolved(matings: list[float], sentence: str) -> None:
    """From the first generation to the mean of the last ones."""
    assert say_what_evolved(matings) == sentence


@pytest.mark.parametrize(
    ("pairs", "end"),
    [
        ([], "and have not mated yet."),
        ([(0, 1)], "and mated once: robots 0 and 1 once."),
        ([(0, 1), (0, 1), (0, 2)], "and mated 3 times: robots 0 and 1 twice, robots 0 and 2 once."),
    ],
)
def test_the_second_says_who_mated_with_whom(pairs: list[tuple[int, int]], end: str) -> None:
    """And for how long they lived."""
    robots = tuple(bytes([number] * 16) for number in range(3))
    merged = MergedHistory(robots, tuple(mated(*pair) for pair in pairs), ())
    assert say_who_mated(merged, 92.4) == f"3 robots, each its own process, lived on for 92 s {end}"
    assert say_who_mated(None, 0.0) == "No robot has lived as a process of its own yet."


def test_the_third_says_where_it_is_and_how_to_go_on() -> None:
    """With the robots that live, or if none do, with those that evolved."""
    folder = Path("runs/my demo")
    assert say_where(folder, True) == (
        "All of it is in runs/my demo; its robots live on with:"
        " crcolony launch --out 'runs/my demo/live'"
    )
    assert "crcolony launch --from 'runs/my demo/evolved'" in say_where(folder, False)
