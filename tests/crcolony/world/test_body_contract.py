"""A simulated body fulfils the contract of a body, with all its senses."""

import numpy as np

from crcolony.body import contract
from crcolony.body.contract import Body
from crcolony.body.contract_test import BodyContract
from crcolony.compiled import FloatArray
from crcolony.world.arena import Arena
from tests.support.small_arenas import new_arena


class ArenaBody:
    """The body of the only robot in an arena: to read an observation simulates a control period."""

    def __init__(self, arena: Arena) -> None:
        self.arena = arena

    def read(self) -> FloatArray:
        self.arena.integrate()
        return np.array(self.arena.observe()[0])

    def act(self, action: FloatArray) -> FloatArray:
        return self.arena.act(0, action)

    def close(self) -> None:
        self.arena.act(0, np.zeros(contract.ACTION_WIDTH))


class TestArenaBody(BodyContract):
    """The default control period is that of the contract's tests."""

    def new_body(self) -> Body:
        senses = {"infrared": True, "inertial": True, "microphones": True}
        return ArenaBody(new_arena(packs=6, width_m=2.0, body=senses))
