"""The kinds of robots are consistent, and are told by the names of their nodes."""

import numpy as np
import pytest
from crcolony_bridge.aseba.models import E_PUCK, MODELS, THYMIO, AsebaModel, find_model

from crcolony.body import contract


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.uid)
def test_a_nearer_thing_is_never_farther(model: AsebaModel) -> None:
    """Curves fall from the range to 0, and bearings rise from right to left."""
    proximity = model.proximity
    assert (np.diff(proximity.curve_raw) > 0).all()
    assert (np.diff(proximity.curve_m) < 0).all()
    assert proximity.curve_m[-1] == 0.0
    assert (np.diff(proximity.bearings_rad) > 0).all()
    assert len(proximity.columns) == len(proximity.bearings_rad) == contract.PROXIMITY_SENSORS


def test_a_model_is_found_by_the_name_of_the_node() -> None:
    """And an unknown one is none."""
    assert find_model("e-puck3") is E_PUCK
    assert find_model("thymio-II") is THYMIO
    assert find_model("challenge") is None
