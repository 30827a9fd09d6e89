"""Making the arrays of `state.py`: step parameters, and robots that have not started yet."""

from collections.abc import Sequence

import numpy as np

from crcolony.body import contract
from crcolony.body.settings import CyberRodent
from crcolony.learning.features import grid_axis, uniform_offsets
from crcolony.learning.traces import DECAY
from crcolony.randomness import new_streams
from crcolony.robot.genes import module_genes, selector_inputs
from crcolony.robot.modules import MODULES, LearningModule
from crcolony.robot.settings import Learning, Life
from crcolony.robot.state import Robots, StepParameters
from crcolony.robot.weight_rows import all_blocks, block_count, no_rows, table_rows


def step_parameters(
    learning: Learning,
    life: Life,
    rodent: CyberRodent,
    modules: Sequence[LearningModule] = MODULES,
) -> StepParameters:
    """Return settings and modules as the compiled step reads them."""
    range_m, half_angle_rad = rodent.camera_range_m, rodent.camera_half_angle_rad
    distances_m, distance_width_m = grid_axis(0.0, range_m, learning.potential_distances)
    bearings_rad, bearing_width_rad = grid_axis(0.0, half_angle_rad, learning.potential_bearings)
    tile_counts = np.array([learning.distance_tiles, learning.bearing_tiles])
    return StepParameters(
        targets=np.array([module.target for module in modules]),
        successes=np.array([module.success for module in modules]),
        beacons=np.array([1.0 if module.beacon else 0.0 for module in modules]),
        refractory_steps=np.array(
            [life.refractory_steps if module.is_refractory else 0 for module in modules]
        ),
        jaws=np.array([float(module.name in learning.jaw_modules) for module in modules]),
        regarded_colours=np.array([_regarded_colours(module, learning) for module in modules]),
        lamps=np.array([module.lamp for module in modules]),
        wheel_speeds=np.array(
            [
                (speed - 0.5 * rodent.track_m * turn, speed + 0.5 * rodent.track_m * turn)
                for speed in learning.speeds_m_s
                for turn in learning.turns_rad_s
            ]
        ),
        low=np.array([0.0, -half_angle_rad]),
        tiles_per_unit=tile_counts / np.array([range_m, 2.0 * half_angle_rad]),
        tile_counts=tile_counts,
        tile_offsets=uniform_offsets(learning.tilings, 2),
        grid_tiles=learning.tilings * int(np.prod(tile_counts + 1)),
        potential_distances_m=distances_m,
        potential_distance_width_m=distance_width_m,
        potential_bearings_rad=bearings_rad,
        potential_bearing_width_rad=bearing_width_rad,
        selector_genes=(len(modules) - 1) * len(selector_inputs(modules)),
        module_genes=module_genes(learning),
        initial_weight=learning.initial_value / learning.tilings,
        energy_per_step=life.energy_per_step,
        slice_steps=life.slice_steps,
        action_ttl_s=learning.action_ttl_s,
    )


def _regarded_colours(module: LearningModule, learning: Learning) -> tuple[float, float, float]:
    """Return which of red, green and blue a target of the module has to show one of; none: it may
    be dark."""
    if module.target != contract.FACE or learning.visible_mates == "any":
        return (0.0, 0.0, 0.0)
    return module.lamp if learning.visible_mates == "ready" else (1.0, 1.0, 1.0)


def weight_bytes(
    count: int, learning: Learning, life: Life, modules: Sequence[LearningModule] = MODULES
) -> int:
    """Return the bytes of the weights of all agents of `count` robots, once they have visited every
    tile: nearly all the memory that robots need."""
    tiles = learning.tilings * ((learning.distance_tiles + 1) * (learning.bearing_tiles + 1) + 2)
    actions = len(learning.speeds_m_s) * len(learning.turns_rad_s)
    return 4 * table_rows(count, life.agents * len(modules) * tiles) * actions


def empty_robots(
    count: int, parameters: StepParameters, agents: int, genes: int, seed: int
) -> Robots:
    """Return `count` robots of zeros, with random streams of their own: no genotypes, no energy,
    nothing learnt."""
    modules = parameters.targets.shape[0]
    actions = parameters.wheel_speeds.shape[0]
    tilings = parameters.tile_offsets.shape[0]
    tiles = parameters.grid_tiles + 2 * tilings
    own_tiles = agents * modules * tiles
    blocks = all_blocks(count, own_tiles)
    trace_totals = np.zeros((count, 3))
    trace_totals[:, DECAY] = 1.0
    return Robots(
        steps=np.zeros(count, dtype=np.int64),
        agent=np.zeros(count, dtype=np.int64),
        slice_steps_left=np.zeros(count, dtype=np.int64),
        module=np.full(count, -1),
        action=np.zeros(count, dtype=np.int64),
        state_tiles=np.zeros((count, tilings), dtype=np.int64),
        potential=np.zeros(count),
        sides=np.zeros((count, modules), dtype=np.int64),
        refractory_left=np.zeros((count, modules), dtype=np.int64),
        events=np.zeros(count, dtype=np.int64),
        streams=new_streams(seed, (1,), count),
        genotypes=np.zeros((count, agents, genes)),
        energies=np.zeros((count, agents)),
        module_steps=np.zeros((count, agents, modules), dtype=np.int64),
        captures=np.zeros((count, agents), dtype=np.int64),
        matings=np.zeros((count, agents), dtype=np.int64),
        mating_energy_sum=np.zeros((count, agents)),
        steps_alive=np.zeros((count, agents), dtype=np.int64),
        energy_sum=np.zeros((count, agents)),
        weights=np.zeros((table_rows(count, own_tiles), actions), dtype=np.float32),
        weight_rows=no_rows(count, agents, modules, tiles),
        rows_used=np.zeros(count, dtype=np.int64),
        weight_blocks=np.zeros((count, block_count(own_tiles)), dtype=np.int64),
        free_blocks=blocks,
        free_count=np.array([blocks.size]),
        traces=np.zeros((count, tiles, 4)),
        traced_tiles=np.zeros((count, tiles), dtype=np.int64),
        trace_totals=trace_totals,
        values=np.zeros(actions),
        scratch_softmax=np.zeros(actions),
        next_tiles=np.zeros(tilings, dtype=np.int64),
        next_rows=np.zeros(tilings, dtype=np.int64),
        state_rows=np.zeros(tilings, dtype=np.int64),
        scratch_state=np.zeros(2),
        scratch_distance=np.zeros(parameters.potential_distances_m.shape[0]),
        scratch_bearing=np.zeros(parameters.potential_bearings_rad.shape[0]),
        visible=np.zeros((count, modules)),
    )
