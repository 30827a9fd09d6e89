"""Making the arrays of `state.py`: habits from settings, and robots that have not lived yet."""

from collections.abc import Sequence

import numpy as np

from crcolony.body.settings import CyberRodent
from crcolony.learning.features import grid_axis, uniform_offsets
from crcolony.randomness import new_streams
from crcolony.robot.genes import module_genes, selector_inputs
from crcolony.robot.modules import MODULES, LearningModule
from crcolony.robot.settings import Learning, Life
from crcolony.robot.state import Robots, StepParameters


def step_parameters(
    learning: Learning,
    life: Life,
    rodent: CyberRodent,
    modules: Sequence[LearningModule] = MODULES,
) -> StepParameters:
    """Return settings and modules as the compiled step reads them."""
    range_m, half_angle = rodent.camera_range_m, rodent.camera_half_angle_rad
    distances, distance_width_m = grid_axis(0.0, range_m, learning.potential_distances)
    bearings, bearing_width_rad = grid_axis(0.0, half_angle, learning.potential_bearings)
    tiles = np.array([learning.distance_tiles, learning.bearing_tiles])
    return StepParameters(
        targets=np.array([module.target for module in modules]),
        successes=np.array([module.success for module in modules]),
        beacons=np.array([1.0 if module.beacon else 0.0 for module in modules]),
        refractory_steps=np.array(
            [life.refractory_steps if module.rests else 0 for module in modules]
        ),
        lamps=np.array([module.lamp for module in modules]),
        wheels=np.array(
            [
                (speed - 0.5 * rodent.track_m * turn, speed + 0.5 * rodent.track_m * turn)
                for speed in learning.speeds_m_s
                for turn in learning.turns_rad_s
            ]
        ),
        low=np.array([0.0, -half_angle]),
        high=np.array([range_m, half_angle]),
        tiles=tiles,
        offsets=uniform_offsets(learning.tilings, 2),
        grid_tiles=learning.tilings * int(np.prod(tiles + 1)),
        distances=distances,
        distance_width_m=distance_width_m,
        bearings=bearings,
        bearing_width_rad=bearing_width_rad,
        selector_genes=(len(modules) - 1) * len(selector_inputs(modules)),
        module_genes=module_genes(learning),
        initial_weight=learning.initial_value / learning.tilings,
        energy_per_step=life.energy_per_step,
        slice_steps=life.slice_steps,
        action_ttl_s=learning.action_ttl_s,
    )


def weight_bytes(
    count: int, learning: Learning, life: Life, modules: Sequence[LearningModule] = MODULES
) -> int:
    """Return how much memory the weights of all agents of `count` robots take: nearly all that robots need."""
    tiles = learning.tilings * ((learning.distance_tiles + 1) * (learning.bearing_tiles + 1) + 2)
    actions = len(learning.speeds_m_s) * len(learning.turns_rad_s)
    return 8 * count * life.agents * len(modules) * tiles * actions


def empty_robots(
    count: int, parameters: StepParameters, agents: int, genes: int, seed: int
) -> Robots:
    """Return `count` robots with nothing in them: no genotypes, no energy, nothing learnt."""
    modules = parameters.targets.shape[0]
    actions = parameters.wheels.shape[0]
    tilings = parameters.offsets.shape[0]
    tiles = parameters.grid_tiles + 2 * tilings
    clock = np.zeros((count, 3))
    clock[:, 0] = 1.0
    return Robots(
        steps=np.zeros(count, dtype=np.int64),
        agent=np.zeros(count, dtype=np.int64),
        slice_steps_left=np.zeros(count, dtype=np.int64),
        module=np.full(count, -1),
        action=np.zeros(count, dtype=np.int64),
        tiles=np.zeros((count, tilings), dtype=np.int64),
        potential=np.zeros(count),
        sides=np.zeros((count, modules), dtype=np.int64),
        refractory_left=np.zeros((count, modules), dtype=np.int64),
        events=np.zeros(count, dtype=np.int64),
        streams=new_streams(seed, (1,), count),
        genotypes=np.zeros((count, agents, genes)),
        energies=np.zeros((count, agents)),
        used=np.zeros((count, agents, modules), dtype=np.int64),
        captures=np.zeros((count, agents), dtype=np.int64),
        matings=np.zeros((count, agents), dtype=np.int64),
        steps_alive=np.zeros((count, agents), dtype=np.int64),
        energy_sum=np.zeros((count, agents)),
        weights=np.zeros((count, agents, modules, tiles, actions)),
        traces=np.zeros((count, tiles, 3)),
        active_tiles=np.zeros((count, tiles), dtype=np.int64),
        clock=clock,
        values=np.zeros(actions),
        chances=np.zeros(actions),
        next_tiles=np.zeros(tilings, dtype=np.int64),
        scratch_state=np.zeros(2),
        scratch_distance=np.zeros(parameters.distances.shape[0]),
        scratch_bearing=np.zeros(parameters.bearings.shape[0]),
        visible=np.zeros(modules),
    )
