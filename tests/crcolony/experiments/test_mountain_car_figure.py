"""The figure of the mountain car shows curves, genes and a potential."""

import numpy as np
import pytest

from crcolony.experiments.framework.experiment import CONDITION, SEED, Row
from crcolony.experiments.mountain_car_claims import BOTH, META_ALONE, OMPAC, TEXTBOOK
from crcolony.experiments.mountain_car_figure import draw, potential_image
from crcolony.experiments.worlds.mountain_car_genes import HIGH, LOW, WEIGHTS


def rows_of(seed: int) -> list[Row]:
    """Return rows as runs of a seed leave them."""
    rows: list[Row] = []
    for condition in (BOTH, META_ALONE, TEXTBOOK, OMPAC):
        curve: list[Row] = [
            {"episode": k + 1, "steps": 100.0 + seed, "founder_steps": 900.0} for k in range(3)
        ]
        genes: list[Row] = [
            {"generation": k, "lambda_mean": 0.1 * seed, "alpha_mean": 1.0, "temperature": 0.5}
            for k in range(3)
        ]
        weights: Row = {f"potential_{k}": float(k) for k in range(WEIGHTS)}
        chosen: list[Row] = [{"chosen_steps": 100.0 - seed, **weights}]
        rows += [{CONDITION: condition, SEED: seed, **row} for row in (*curve, *genes, *chosen)]
    return rows


def test_the_figure_shows_curves_genes_and_a_potential() -> None:
    """Medians over seeds, and the potential of the run whose learner was the best when it was chosen."""
    curves, genes, picture, _ = draw(rows_of(1) + rows_of(3)).axes
    labels = ["evolved", "best founder", "meta-parameters alone", "textbook"]
    labels.append("OMPAC, as it learns")
    assert [line.get_label() for line in curves.lines] == labels
    assert np.asarray(curves.lines[0].get_ydata()).tolist() == [102.0] * 3
    assert np.asarray(genes.lines[0].get_ydata()).tolist() == pytest.approx([0.2] * 3)
    assert "seed 3" in picture.get_title() + picture.get_title(loc="left")


def test_the_image_of_a_potential_is_that_of_its_states() -> None:
    """Positions first; equal weights are an even potential."""
    positions, speeds, values = potential_image(np.full(WEIGHTS, 7.0))
    assert (positions[0], positions[-1]) == (LOW[0], HIGH[0])
    assert (speeds[0], speeds[-1]) == (LOW[1], HIGH[1])
    assert values == pytest.approx(np.full((positions.size, speeds.size), 7.0))
