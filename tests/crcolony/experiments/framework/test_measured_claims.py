"""Each claim stands beside what was measured."""

import json
from pathlib import Path

from crcolony.experiments.framework.experiment import Measured, Row
from crcolony.experiments.framework.measured_claims import (
    estimate_text,
    format_claims,
    measure_claims,
    write_claims,
)
from crcolony.experiments.framework.registration import parse_registration
from tests.support.fake_experiment import REGISTRATION, fake_experiment

ROWS: list[Row] = [
    {"condition": "control", "seed": 1, "number": 1.0},
    {"condition": "treated", "seed": 1, "number": 2.5},
]


def test_claims_are_measured_printed_and_written(tmp_path: Path) -> None:
    """With the verdict, the statistic and the threshold that was registered; too few seeds are said."""
    found = measure_claims(fake_experiment(), parse_registration(REGISTRATION), ROWS)
    lines = list(format_claims(found, seeds=1))
    assert lines[0] == "larger: reproduced (of 1 seeds; the claim asks for 4)"
    assert lines[-1].endswith("1.5; by eye, p = 0.01, d = 1.50")
    assert next(format_claims(found, seeds=4)) == "larger: reproduced"
    write_claims(tmp_path, found, is_quick=True)
    written = json.loads((tmp_path / "claims.json").read_text())
    assert written["is_quick"]
    (one,) = written["claims"]
    assert one["claim"]["threshold"] == 0.5
    assert one["measured"]["verdict"] == "reproduced"
    assert one["measured"]["low"] is None, "there is no interval"


def test_an_estimate_has_its_interval_where_there_is_one() -> None:
    """Three digits are enough."""
    measured = Measured(estimate=1.23456, low=1.0, high=2.0, statistic="", runs=3, verdict="not")
    assert estimate_text(measured) == "1.23 (1 to 2)"


def test_in_a_terminal_lines_are_wrapped_and_stay_in_their_column() -> None:
    """Nothing is lost by that."""
    found = measure_claims(fake_experiment(), parse_registration(REGISTRATION), ROWS)
    whole, wrapped = (list(format_claims(found, seeds=4, columns=width)) for width in (None, 40))
    assert max(map(len, wrapped)) <= 40
    assert all(line.startswith(" " * 4) for line in wrapped[1:])
    assert "".join(wrapped).replace(" ", "") == "".join(whole).replace(" ", "")
