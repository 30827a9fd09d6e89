"""The evolved stand beside the founders."""

import dataclasses

import numpy as np
from crcolony_dashboards.view_model.comparison import INPUTS, format_comparison
from crcolony_dashboards.view_model.gene_statistics import GeneStatistics
from crcolony_dashboards.view_model.generation_history import GenerationHistory
from crcolony_dashboards.view_model.generations import Spread

from crcolony.robot.genes import selector_inputs
from tests.dashboards.view_model.test_generation_history import row


def genes(offset: float) -> GeneStatistics:
    meta_parameters = offset + np.arange(30.0).reshape(2, 5, 3)
    return GeneStatistics(meta_parameters, np.array([offset] * 4), np.array([0.0, offset]))


def test_the_first_generation_is_compared_with_the_last() -> None:
    """What agents did, their median meta-parameters, potentials and selector."""
    history = GenerationHistory()
    first = dataclasses.replace(row(0), genes=genes(0.25))
    last = dataclasses.replace(row(9), matings=Spread(7.5, 1.0, 6.0, 9.0), genes=genes(0.5))
    for one in (first, row(5), last):
        history.add(one)
    lines = format_comparison(history, "wait").splitlines()
    assert lines[0] == "| | founders (generation 0) | evolved (generation 9) |"
    assert "| matings of an agent | 1.00 | 7.50 |" in lines
    assert "| α (foraging · mating) | 1.25 · 16.25 | 1.50 · 16.50 |" in lines
    assert "| Φ at its target − far away | +0.00 · +0.25 | +0.00 · +0.50 |" in lines
    assert "| selector: energy | +0.25 | +0.50 |" in lines


def test_a_colony_seen_late_has_no_founders() -> None:
    """Its first generation that was seen stands in their place; unread genes are left out."""
    history = GenerationHistory()
    for number in (57, 58):
        history.add(row(number))
    text = format_comparison(history, "wait")
    assert text.startswith("| | first seen (generation 57) | evolved (generation 58) |")
    assert "selector" not in text


def test_before_two_generations_there_is_nothing_to_compare() -> None:
    """A text says what is waited for."""
    history = GenerationHistory()
    assert format_comparison(history, "wait") == "wait"
    history.add(row(0))
    assert format_comparison(history, "wait") == "wait"


def test_every_input_of_the_selector_has_words() -> None:
    """One each, in order."""
    assert len(INPUTS) == len(selector_inputs())
    assert [name.split("_")[0] for name in selector_inputs()] == [
        "bias",
        "energy",
        "foraging",
        "mating",
    ]
