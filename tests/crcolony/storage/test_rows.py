"""Rows hold records and decisions exactly."""

from dataclasses import replace

import pytest

from crcolony.storage.rows import UNDECIDED, decision_columns, decision_of, record_of, row_of
from tests.support.robot_stores import answered, decision, proposed


def test_a_row_holds_a_record_exactly() -> None:
    """Of either role, with or without a partner."""
    alone = replace(answered(1), partner=None, proof=b"", orphaned=True)
    for record in (proposed(1), answered(2, "mated"), alone):
        assert record_of(row_of(record)) == record


def test_a_row_holds_a_decision_exactly() -> None:
    """With or without offspring; before there is a decision it holds none."""
    for number in range(4):
        row = row_of(proposed(number)) | decision_columns(decision(number)) | {"serial": 3}
        assert decision_of(row) == decision(number)
    assert decision_of(row_of(proposed(1)) | UNDECIDED) is None


def test_an_energy_that_is_not_finite_is_a_bug() -> None:
    """SQLite would store it as NULL, or as a number that no digest agrees with; -0.0 becomes 0.0."""
    for energy in (float("nan"), float("inf")):
        with pytest.raises(ValueError, match="an energy of"):
            decision_columns(replace(decision(1), energy=energy))
    assert str(decision_columns(replace(decision(1), energy=-0.0))["energy"]) == "0.0"
