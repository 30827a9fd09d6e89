"""The tables of the body contract, and the simulated body against it."""

import numpy as np

from crcolony.body import contract
from crcolony.body.contract import ACTION, OBSERVATION, Body, Quantity, columns
from crcolony.body.contract_test import BodyContract
from crcolony.compiled import FloatArray
from crcolony.world.arena import Arena
from tests.support.small_arenas import new_arena

UNITS = ("_m", "_rad", "_m_s", "_rad_s", "_m_s2", "_s")
"""A quantity without a unit is a share, a flag, a colour, or a number that counts."""
PLAIN = {"visible", "red", "green", "blue", "jaw", "holds", "charge", "battery", "speaker"}
PLAIN |= {"left", "right", "beacon", "encounter", "robot", "nonce"}


class ArenaBody:
    """The body of the only robot in an arena: reading lets a period pass."""

    def __init__(self, arena: Arena) -> None:
        self.arena = arena

    def read(self) -> FloatArray:
        self.arena.advance()
        return np.array(self.arena.observe()[0])

    def act(self, action: FloatArray) -> FloatArray:
        return self.arena.act(0, action)

    def close(self) -> None:
        self.arena.act(0, np.zeros(contract.ACTION_WIDTH))


class TestArenaBody(BodyContract):
    """The simulated body keeps the contract, with all its senses."""

    def new_body(self) -> Body:
        senses = {"infrared": True, "inertial": True, "microphones": True}
        return ArenaBody(new_arena(packs=6, width_m=2.0, body=senses))


def test_names_end_in_their_unit_and_ranges_hold_something() -> None:
    """For every quantity of both tables, and no name stands twice."""
    for table in (OBSERVATION, ACTION):
        assert len(columns(table)) == len(table)
        for quantity in table:
            assert isinstance(quantity, Quantity)
            assert quantity.low < quantity.high
            assert quantity.meaning
            assert quantity.name.endswith(UNITS) or quantity.name.split("_")[-1] in PLAIN


def test_the_columns_are_those_of_the_table() -> None:
    """Compiled code counts on them."""
    names = [quantity.name for quantity in OBSERVATION]
    assert names[contract.PACK + contract.DISTANCE] == "pack_distance_m"
    assert names[contract.FACE + contract.BEARING] == "face_bearing_rad"
    assert names[contract.TAIL + contract.COLOUR] == "tail_red"
    assert names[contract.PROXIMITY + 6] == "proximity_6_m"
    assert names[contract.ACCELERATION + 1] == "acceleration_left_m_s2"
    assert names[contract.WHEELS + 1] == "wheel_right_m_s"
    assert names[contract.MICROPHONES + 1] == "microphone_right"
    acted = [quantity.name for quantity in ACTION]
    assert acted[contract.LED + 2] == "led_blue"
    assert (len(names), len(acted)) == (contract.OBSERVATION_WIDTH, contract.ACTION_WIDTH)
