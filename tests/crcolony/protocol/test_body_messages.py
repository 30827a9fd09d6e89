"""Rows and nonces between a robot and its body."""

import math

import numpy as np
import pytest

from crcolony.body.contract import OBSERVATION_WIDTH
from crcolony.protocol.body_messages import pack_row, unpack_row
from crcolony.protocol.codec import WireError
from tests.vectors.make import NONCE


def test_a_row_contains_finite_numbers_only() -> None:
    """A row with NaN or an infinity is refused."""
    row = np.zeros(OBSERVATION_WIDTH)
    assert unpack_row(pack_row(row)).tolist() == row.tolist()
    for number in (math.nan, math.inf, -math.inf):
        row[3] = number
        with pytest.raises(WireError, match="not finite"):
            unpack_row(pack_row(row))


def test_a_nonce_fits_into_a_column_of_an_observation() -> None:
    """The row contains the nonce as a float64, which represents 48 bits exactly."""
    assert int(float(2**48 - 1)) == 2**48 - 1
    assert int(float(NONCE)) == NONCE
