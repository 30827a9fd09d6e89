"""The tables of the body contract, and the simulated body against it."""

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.world import body
from crcolony.world.arena import Arena
from crcolony.world.body import ACTION, OBSERVATION, Body, Quantity, columns
from tests.world.body_contract import BodyContract
from tests.world.places import new_arena

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
        self.arena.act(0, np.zeros(body.ACTION_WIDTH))


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
    assert names[body.PACK + body.DISTANCE] == "pack_distance_m"
    assert names[body.FACE + body.BEARING] == "face_bearing_rad"
    assert names[body.TAIL + body.COLOUR] == "tail_red"
    assert names[body.PROXIMITY + 6] == "proximity_6_m"
    assert names[body.ACCELERATION + 1] == "acceleration_left_m_s2"
    assert names[body.WHEELS + 1] == "wheel_right_m_s"
    assert names[body.MICROPHONES + 1] == "microphone_right"
    acted = [quantity.name for quantity in ACTION]
    assert acted[body.LED + 2] == "led_blue"
    assert (len(names), len(acted)) == (body.OBSERVATION_WIDTH, body.ACTION_WIDTH)
