"""The control step of Paper III: energy, module selection, Algorithm 2.2 with eq. 3.1, action.

This is the readable definition and the compiled code at once, for one robot of a batch. What is
rare (a mating, a hand-over, a turnover) is only marked here, as an event, and done in `robot.py`.
"""

from crcolony.body import contract
from crcolony.compiled import FloatArray, compiled
from crcolony.learning.features import grid_rbf_value, tile_indices
from crcolony.learning.policies import greedy, hyperbolic_decay, softmax
from crcolony.learning.sarsa_lambda import update_weights
from crcolony.learning.shaping import potential_shaping
from crcolony.learning.traces import action_values, clear_traces, set_traces
from crcolony.randomness import draw
from crcolony.robot.energy import next_energy
from crcolony.robot.genes import ALPHA, GAMMA, LAMBDA, POTENTIAL, TAU, TAU_DECAY
from crcolony.robot.state import DIED, MET, SLICE_OVER, Robots, StepParameters
from crcolony.robot.weight_rows import find_rows, give_rows


@compiled
def step_robot(
    robots: Robots, parameters: StepParameters, i: int, observation: FloatArray, action: FloatArray
) -> None:
    """Advance robot i by one control step: read its observation (row), write its action (row) and
    its events.

    The step that ends a slice learns from the last action and then stops the wheels, for the next
    agent to start.
    """
    agent = robots.agent[i]
    robots.events[i] = 0
    for column in range(contract.ACTION_WIDTH):
        action[column] = 0.0
    robots.steps[i] += 1
    robots.slice_steps_left[i] -= 1
    if robots.energies[i, agent] > 0.0:
        _update_energy(robots, parameters, i, agent, observation)
    if robots.energies[i, agent] > 0.0:
        _update_visibility(robots, parameters, i, observation)
        _learn_and_select(robots, parameters, i, agent, observation)
        if robots.slice_steps_left[i] > 0:
            _write_action(robots, parameters, i, action)
    if robots.slice_steps_left[i] == 0:
        _release_module(robots, parameters, i, agent)
        robots.events[i] += SLICE_OVER


@compiled
def step_robots(
    robots: Robots, parameters: StepParameters, observations: FloatArray, actions: FloatArray
) -> int:
    """Advance all robots by a control step, rows (N, width) each; return the bits of all events."""
    events = 0
    for i in range(robots.agent.shape[0]):
        step_robot(robots, parameters, i, observations[i], actions[i])
        events |= robots.events[i]
    return events


@compiled
def _update_energy(
    robots: Robots, parameters: StepParameters, i: int, agent: int, observation: FloatArray
) -> None:
    """Add the charge and subtract the cost of a step; count captures and encounters; the agent dies
    at 0."""
    charge = observation[contract.CHARGE]
    energy = next_energy(robots.energies[i, agent], charge, parameters.energy_per_step)
    robots.energies[i, agent] = energy
    robots.steps_alive[i, agent] += 1
    robots.energy_sum[i, agent] += energy
    if charge > 0.0 and observation[contract.JAW_HOLDS] == 0.0:
        robots.captures[i, agent] += 1
    if observation[contract.ENCOUNTER] > 0.0:
        robots.matings[i, agent] += 1
        robots.mating_energy_sum[i, agent] += energy
        robots.events[i] += MET
    if energy <= 0.0:
        robots.events[i] += DIED
        _release_module(robots, parameters, i, agent)


@compiled
def _update_visibility(
    robots: Robots, parameters: StepParameters, i: int, observation: FloatArray
) -> None:
    """Write which targets are visible to their modules, and on which side they were seen last."""
    for m in range(parameters.targets.shape[0]):
        if observation[parameters.successes[m]] > 0.0:
            robots.refractory_left[i, m] = parameters.refractory_steps[m]
        elif robots.refractory_left[i, m] > 0:
            robots.refractory_left[i, m] -= 1
        robots.visible[i, m] = 0.0
        target = parameters.targets[m]
        if (
            observation[target] > 0.0
            and robots.refractory_left[i, m] == 0
            and _shows(observation, target, parameters.regarded_colours[m])
        ):
            robots.visible[i, m] = 1.0
            robots.sides[i, m] = 1 if observation[target + contract.BEARING] < 0.0 else 0


@compiled
def _shows(observation: FloatArray, blob: int, colours: FloatArray) -> bool:
    """Return whether a blob shows one of the regarded `colours` (3,), or none is regarded."""
    brightness, regarded = 0.0, 0.0
    for c in range(3):
        brightness += colours[c] * observation[blob + contract.COLOUR + c]
        regarded += colours[c]
    return regarded == 0.0 or brightness >= 0.5


@compiled
def select_module(genes: FloatArray, energy: float, visible: FloatArray, modules: int) -> int:
    """Return the module with the largest selector output; the first module's output is 0 by
    definition.

    `genes` begins with a row for every other module: weights of the bias, the energy, and each
    visible target.
    """
    best, highest = 0, 0.0
    inputs = 2 + modules
    for m in range(1, modules):
        row = (m - 1) * inputs
        output = genes[row] + genes[row + 1] * energy
        for k in range(modules):
            output += genes[row + 2 + k] * visible[k]
        if output > highest:
            best, highest = m, output
    return best


@compiled
def _learn_and_select(
    robots: Robots, parameters: StepParameters, i: int, agent: int, observation: FloatArray
) -> None:
    """Select the module in control; learn from the last action (Algorithm 2.2); select the next
    one.

    A module that loses control learns from its last action as well, as if the greedy action were
    next; then its traces are cleared.
    """
    genes = robots.genotypes[i, agent]
    modules = parameters.targets.shape[0]
    before = robots.module[i]
    module = select_module(genes, robots.energies[i, agent], robots.visible[i], modules)
    if before >= 0 and before != module:
        potential = _evaluate_state(robots, parameters, i, agent, before, observation)
        preferred = greedy(robots.values, draw(robots.streams[i]))
        _learn(robots, parameters, i, agent, before, observation, potential, preferred)
        _release_module(robots, parameters, i, agent)
    potential = _evaluate_state(robots, parameters, i, agent, module, observation)
    own = parameters.selector_genes + module * parameters.module_genes
    tau = hyperbolic_decay(
        genes[own + TAU], genes[own + TAU_DECAY], robots.module_steps[i, agent, module]
    )
    chosen = softmax(robots.values, tau, robots.scratch_softmax, draw(robots.streams[i]))
    if before == module:
        _learn(robots, parameters, i, agent, module, observation, potential, chosen)
    set_traces(
        robots.weights,
        robots.traces[i],
        robots.traced_tiles[i],
        robots.trace_totals[i],
        robots.next_tiles,
        robots.next_rows,
        chosen,
        genes[own + GAMMA] * genes[own + LAMBDA],
        genes[own + ALPHA] / parameters.tile_offsets.shape[0],
    )
    for tiling in range(parameters.tile_offsets.shape[0]):
        robots.state_tiles[i, tiling] = robots.next_tiles[tiling]
    robots.module[i] = module
    robots.action[i] = chosen
    robots.potential[i] = potential
    robots.module_steps[i, agent, module] += 1


@compiled
def _evaluate_state(
    robots: Robots,
    parameters: StepParameters,
    i: int,
    agent: int,
    module: int,
    observation: FloatArray,
) -> float:
    """Write a module's active tiles and action values of the present state to scratch; return its
    potential.

    A target out of sight has two tiles of its own in every tiling (last seen left, last seen right)
    and no potential.
    """
    genes = robots.genotypes[i, agent]
    own = parameters.selector_genes + module * parameters.module_genes
    potential = 0.0
    if robots.visible[i, module] > 0.0:
        distance_m = observation[parameters.targets[module] + contract.DISTANCE]
        bearing_rad = observation[parameters.targets[module] + contract.BEARING]
        robots.scratch_state[0] = distance_m
        robots.scratch_state[1] = bearing_rad
        tile_indices(
            robots.scratch_state,
            parameters.low,
            parameters.tiles_per_unit,
            parameters.tile_counts,
            parameters.tile_offsets,
            robots.next_tiles,
        )
        potential = grid_rbf_value(
            distance_m,
            abs(bearing_rad),
            parameters.potential_distances_m,
            parameters.potential_distance_width_m,
            parameters.potential_bearings_rad,
            parameters.potential_bearing_width_rad,
            genes[own + POTENTIAL : own + parameters.module_genes],
            robots.scratch_distance,
            robots.scratch_bearing,
        )
    else:
        for tiling in range(parameters.tile_offsets.shape[0]):
            robots.next_tiles[tiling] = parameters.grid_tiles + 2 * tiling + robots.sides[i, module]
    give_rows(robots, i, agent, module, parameters.initial_weight)
    action_values(
        robots.weights,
        robots.traces[i],
        robots.trace_totals[i],
        robots.next_tiles,
        robots.next_rows,
        genes[own + ALPHA] / parameters.tile_offsets.shape[0],
        robots.values,
    )
    return potential


@compiled
def _learn(
    robots: Robots,
    parameters: StepParameters,
    i: int,
    agent: int,
    module: int,
    observation: FloatArray,
    potential: float,
    following: int,
) -> None:
    """Update the module's weights by the TD error of the last action, with shaping (eq. 2.25 and
    3.1)."""
    own = parameters.selector_genes + module * parameters.module_genes
    gamma = robots.genotypes[i, agent, own + GAMMA]
    reward = 1.0 if observation[parameters.successes[module]] > 0.0 else 0.0
    find_rows(robots, i, agent, module)
    update_weights(
        robots.weights,
        robots.trace_totals[i],
        robots.state_rows,
        robots.action[i],
        reward + potential_shaping(gamma, potential, robots.potential[i]),
        gamma,
        robots.values[following],
    )


@compiled
def _release_module(robots: Robots, parameters: StepParameters, i: int, agent: int) -> None:
    """Clear the traces of the module in control, after its pending updates were applied; none is in
    control then."""
    module = robots.module[i]
    if module < 0:
        return
    own = parameters.selector_genes + module * parameters.module_genes
    rate = robots.genotypes[i, agent, own + ALPHA] / parameters.tile_offsets.shape[0]
    clear_traces(
        robots.weights,
        robots.traces[i],
        robots.traced_tiles[i],
        robots.trace_totals[i],
        rate,
    )
    robots.module[i] = -1


@compiled
def _write_action(robots: Robots, parameters: StepParameters, i: int, action: FloatArray) -> None:
    """Write the selected action: wheels, the module's beacon and lamp, and the time to live.

    The jaw is a reflex: in the modules that close it, it latches on whatever comes into reach.
    """
    module = robots.module[i]
    chosen = robots.action[i]
    action[contract.WHEEL_LEFT] = parameters.wheel_speeds[chosen, 0]
    action[contract.WHEEL_RIGHT] = parameters.wheel_speeds[chosen, 1]
    action[contract.JAW] = parameters.jaws[module]
    if robots.refractory_left[i, module] == 0:
        action[contract.BEACON] = parameters.beacons[module]
    for c in range(3):
        action[contract.LED + c] = parameters.lamps[module, c]
    action[contract.TTL] = parameters.action_ttl_s
