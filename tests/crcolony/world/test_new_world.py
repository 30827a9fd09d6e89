"""The arrays of a new world follow from the settings."""

import math

import pytest

from crcolony.body import contract
from crcolony.body.settings import Noise
from tests.support.small_arenas import new_arena


def test_rules_are_the_settings_as_compiled_code_reads_them() -> None:
    """Angles are cosines, and the drain of the battery is that of a control period."""
    rules = new_arena(
        arena={"control_period_s": 0.5, "height_m": 3.0},
        body={"camera_half_angle_rad": 1.0, "battery_drain_per_s": 0.1},
    ).world.rules
    assert (rules.width_m, rules.height_m) == (4.0, 3.0)
    assert rules.camera_cosine == math.cos(1.0)
    assert rules.battery_drain == pytest.approx(0.05)


def test_noise_is_a_deviation_for_every_column() -> None:
    """Without noise the world is not noisy, and no random number is drawn for it."""
    assert not new_arena().world.rules.is_noisy
    noise = Noise(distance_m=0.1, bearing_rad=0.2, proximity_m=0.3, gyro_rad_s=0.4, wheel_m_s=0.5)
    world = new_arena(body={"noise": noise}).world
    assert world.rules.is_noisy
    for blob in (contract.PACK, contract.FACE, contract.TAIL):
        assert world.noise[blob : blob + 6].tolist() == [0.0, 0.1, 0.2, 0.0, 0.0, 0.0]
    assert world.noise[contract.IR_RANGE : contract.IR_RANGE + 8].tolist() == [0.3] * 8
    assert world.noise[contract.GYRO] == 0.4
    assert world.noise[contract.WHEELS : contract.WHEELS + 2].tolist() == [0.5, 0.5]
    assert not world.noise[contract.JAW_HOLDS :].any()


def test_delay_lines_are_as_long_as_the_latencies() -> None:
    """The present is one more."""
    body = {"action_latency_steps": 2, "observation_latency_steps": 3}
    world = new_arena(2, body=body).world
    assert world.pending.shape == (3, 2, contract.ACTION_WIDTH)
    assert world.observations.shape == (4, 2, contract.OBSERVATION_WIDTH)


def test_packs_have_three_colours_in_turn() -> None:
    """Red, green and blue."""
    colours = new_arena(packs=4).world.pack_colours.tolist()
    assert colours == [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]
