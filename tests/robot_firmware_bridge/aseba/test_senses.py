"""Raw values become distances, things seen, and energy, within the limits of our contract."""

from math import radians

import numpy as np
import pytest
from crcolony_bridge.aseba.models import E_PUCK, THYMIO, AsebaModel
from crcolony_bridge.aseba.senses import Senses, Words, proximity_m, see
from crcolony_bridge.driver import empty_observation
from hypothesis import given
from hypothesis import strategies as st

from crcolony.body import contract
from crcolony.body.contract import OBSERVATION, limits
from crcolony.compiled import FloatArray
from tests.robot_firmware_bridge.aseba.nodes import E_PUCK_NODE, THYMIO_NODE, Node

PROXIMITY = slice(contract.PROXIMITY, contract.PROXIMITY + contract.PROXIMITY_SENSORS)


def seen(first: int, pixels: int, colour: tuple[float, float, float]) -> FloatArray:
    """Return what the e-puck observes of one patch of pixels, counted from the right."""
    assert E_PUCK.camera is not None
    image = np.full((60, 3), 0.5)
    image[first : first + pixels] = colour
    row = empty_observation(0.06)
    see(E_PUCK.camera, image, row)
    return row


def test_columns_go_from_right_to_left() -> None:
    """Each sensor that sees something shows in its own column, and ahead is what either of two sensors sees."""
    for model, sensor, columns in (
        (E_PUCK, 2, {0}),
        (E_PUCK, 0, {2, 3}),
        (E_PUCK, 7, {3, 4}),
        (E_PUCK, 5, {6}),
        (E_PUCK, 3, set()),
        (THYMIO, 4, {1}),
        (THYMIO, 2, {3}),
        (THYMIO, 0, {5}),
        (THYMIO, 6, set()),
    ):
        raw = np.zeros(model.proximity.sensors, np.int16)
        raw[sensor] = 3000
        distances_m = proximity_m(model.proximity, raw)
        near = set(np.flatnonzero(distances_m < model.proximity.range_m))
        assert near == columns, (model.name, sensor)


@pytest.mark.parametrize(
    ("model", "node"), [(E_PUCK, E_PUCK_NODE), (THYMIO, THYMIO_NODE)], ids=["e-puck", "Thymio"]
)
@given(seed=st.integers(0, 2**32 - 1))
def test_whatever_a_robot_sends_the_observation_is_within_its_limits(
    model: AsebaModel, node: Node, seed: int
) -> None:
    """Any words at all, twice in a row."""
    senses = Senses(model, node.described)
    rng = np.random.default_rng(seed)
    low, high = limits(OBSERVATION)
    for _ in range(2):
        words: Words = rng.integers(-32768, 32768, node.described.variable_words, np.int16)
        row, _ = senses.observe(words)
        assert np.isfinite(row).all()
        assert ((row >= low) & (row <= high)).all()


def test_a_red_patch_is_a_face_and_a_green_one_a_pack() -> None:
    """With its bearing, left positive, and its colour; white is nothing."""
    face = seen(45, 6, (0.8, 0.1, 0.1))[contract.FACE :]
    assert face[0] == 1.0
    assert radians(5) < face[contract.BEARING] < radians(30)
    assert face[contract.COLOUR : contract.COLOUR + 3].tolist() == pytest.approx([0.8, 0.1, 0.1])
    pack = seen(10, 6, (0.0, 0.5, 0.17))[contract.PACK :]
    assert pack[0] == 1.0
    assert radians(-30) < pack[contract.BEARING] < radians(-5)
    nothing = seen(10, 6, (0.9, 0.9, 0.9))
    assert not nothing[[contract.PACK, contract.FACE, contract.TAIL]].any()


def test_what_looks_wider_is_nearer() -> None:
    """From the robot's middle, so that it is never nearer than the camera."""
    distances_m = [
        seen(30 - half, 2 * half, (0.0, 0.5, 0.1))[contract.PACK + contract.DISTANCE]
        for half in (1, 3, 8, 30)
    ]
    assert distances_m == sorted(distances_m, reverse=True)
    assert distances_m[-1] > 0.037


def test_energy_is_the_battery() -> None:
    """Of the simulated e-puck; what it gains is for the bridge to say, as of all robots."""
    senses = Senses(E_PUCK, E_PUCK_NODE.described)
    words = np.zeros(E_PUCK_NODE.described.variable_words, np.int16)
    observed = []
    for energy in (10, 14, 13, 2):
        words[E_PUCK_NODE.described.address("energy")] = energy
        row, is_low = senses.observe(words)
        observed.append((row[contract.BATTERY], row[contract.CHARGE], is_low))
    assert observed == [(0.5, 0.0, False), (0.7, 0.0, False), (0.65, 0.0, False), (0.1, 0.0, True)]


def test_what_a_robot_lacks_stays_neutral() -> None:
    """A Thymio without anything near sees, hears and meets nothing, and its battery is full."""
    node = THYMIO_NODE.described
    row, is_low = Senses(THYMIO, node).observe(np.zeros(node.variable_words, np.int16))
    expected = np.zeros(contract.OBSERVATION_WIDTH)
    expected[PROXIMITY] = expected[contract.IR_RANGE] = 0.14
    expected[contract.ENCOUNTER_ROBOT], expected[contract.BATTERY] = -1.0, 1.0
    assert row.tolist() == expected.tolist()
    assert not is_low


def test_an_e_puck_without_camera_or_energy_is_driven_too() -> None:
    """What is optional is used where the robot has it."""
    variables = {k: v for k, v in E_PUCK_NODE.variables.items() if k[:3] not in ("cam", "ene")}
    node = Node("e-puck0", variables, E_PUCK_NODE.events).described
    senses = Senses(E_PUCK, node)
    assert len(senses.spans()) == 3
    row, _ = senses.observe(np.zeros(node.variable_words, np.int16))
    assert row[contract.BATTERY] == 1.0
