"""The control step of Paper III as a textbook would write it: dense traces, nothing compiled.

It is written from the equations of the thesis, as the oracle of `robot/step.py`: energy, selector
(a linear network), Sarsa(lambda) with replacing traces and clearing (Algorithm 2.2), shaping by a
normalised RBF potential (eq. 2.27, 3.1), softmax (eq. 2.18) with a hyperbolically
decaying temperature.
"""

import numpy as np

from crcolony.body import contract
from crcolony.body.settings import CyberRodent
from crcolony.compiled import FloatArray
from crcolony.learning.features import NormalizedRBF, uniform_offsets
from crcolony.robot.genes import decode
from crcolony.robot.modules import MODULES
from crcolony.robot.settings import Learning, Life


class PlainStream:
    """SplitMix64 as its authors print it, with Python's integers."""

    def __init__(self, key: int, counter: int) -> None:
        self.key, self.counter = key, counter

    def draw(self) -> float:
        """Return a number in [0, 1) of 53 bits."""
        self.counter += 1
        mask = 2**64 - 1
        z = (self.key + self.counter * 0x9E3779B97F4A7C15) & mask
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & mask
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & mask
        return ((z ^ (z >> 31)) >> 11) * 2.0**-53


class PlainRobot:
    """One robot with `genotypes` (agents, genes); agent 0 is in control until `hand_over`."""

    def __init__(
        self,
        genotypes: FloatArray,
        stream: PlainStream,
        learning: Learning,
        life: Life,
        rodent: CyberRodent,
    ) -> None:
        self.learning, self.life, self.rodent, self.stream = (
            learning,
            life,
            rodent,
            stream,
        )
        self.agents = [decode(genes, learning) for genes in genotypes]
        self.range = np.array([rodent.camera_range_m, rodent.camera_half_angle_rad])
        self.counts = np.array([learning.distance_tiles, learning.bearing_tiles])
        self.offsets = uniform_offsets(learning.tilings, 2)
        self.grid = learning.tilings * int(np.prod(self.counts + 1))
        self.rbf = NormalizedRBF.grid(
            np.zeros(2),
            self.range,
            np.array([learning.potential_distances, learning.potential_bearings]),
        )
        self.moves = [(v, w) for v in learning.speeds_m_s for w in learning.turns_rad_s]
        shape = (len(genotypes), len(MODULES), self.grid + 2 * learning.tilings, len(self.moves))
        self.theta = np.full(shape, learning.initial_value / learning.tilings)
        self.energy = np.full(len(genotypes), life.initial_energy)
        self.module_steps = np.zeros((len(genotypes), len(MODULES)), dtype=int)
        self.sides = [0 for _ in MODULES]
        self.refractory_left = [0 for _ in MODULES]
        self.hand_over(0)

    def hand_over(self, agent: int) -> None:
        """Give control to an agent for a slice."""
        self.agent, self.slice_steps_left, self.module = agent, self.life.slice_steps, -1
        self.e = np.zeros(self.theta.shape[2:])

    def step(self, observation: FloatArray) -> FloatArray:
        """Do one control step: from an observation to an action."""
        action = np.zeros(contract.ACTION_WIDTH)
        self.slice_steps_left -= 1
        if self.energy[self.agent] == 0.0:
            return action
        charged = min(self.energy[self.agent] + observation[contract.CHARGE], 1.0)
        self.energy[self.agent] = max(charged - self.life.energy_per_step, 0.0)
        if self.energy[self.agent] == 0.0:
            self.module = -1
            return action
        visible = [self._is_visible(m, observation) for m in range(len(MODULES))]
        self._learn_and_select(observation, visible)
        if self.slice_steps_left > 0:
            self._write_action(action)
        return action

    def _is_visible(self, m: int, observation: FloatArray) -> bool:
        module = MODULES[m]
        if observation[module.success] > 0.0:
            self.refractory_left[m] = self.life.refractory_steps if module.is_refractory else 0
        else:
            self.refractory_left[m] = max(self.refractory_left[m] - 1, 0)
        if observation[module.target] == 0.0 or self.refractory_left[m] > 0:
            return False
        red, green, blue = observation[module.target + contract.COLOUR :][:3]
        if module.name == "mating" and self.learning.visible_mates == "lit":
            is_regarded = bool(red + green + blue >= 0.5)
        elif module.name == "mating" and self.learning.visible_mates == "ready":
            is_regarded = bool(red >= 0.5)
        else:
            is_regarded = True
        if not is_regarded:
            return False
        self.sides[m] = int(observation[module.target + contract.BEARING] < 0.0)
        return True

    def _learn_and_select(self, observation: FloatArray, visible: list[bool]) -> None:
        own = self.agents[self.agent]
        inputs = np.array([1.0, self.energy[self.agent], *visible])
        outputs = np.concatenate([[0.0], own.selector @ inputs])
        module = int(np.argmax(outputs))
        before = self.module
        if before >= 0 and before != module:
            tiles, potential = self._evaluate_state(before, observation, visible)
            values = self.theta[self.agent, before, tiles].sum(axis=0)
            ties = np.flatnonzero(values == values.max())
            self._learn(
                before, observation, potential, values[ties[int(self.stream.draw() * len(ties))]]
            )
            self.e[:] = 0.0
        meta = own.meta_parameters[module]
        tiles, potential = self._evaluate_state(module, observation, visible)
        values = self.theta[self.agent, module, tiles].sum(axis=0)
        tau = meta.tau / (1.0 + meta.tau_decay * self.module_steps[self.agent, module])
        with np.errstate(over="ignore"):
            responses = np.exp((values - values.max()) / tau)
        chosen = int(np.argmax(np.cumsum(responses) > self.stream.draw() * responses.sum()))
        if before == module:
            self._learn(module, observation, potential, values[chosen])
        self.e *= meta.gamma * meta.lambda_
        self.e[tiles] = 0.0
        self.e[tiles, chosen] = 1.0
        self.module, self.chosen, self.tiles, self.potential = module, chosen, tiles, potential
        self.module_steps[self.agent, module] += 1

    def _evaluate_state(
        self, m: int, observation: FloatArray, visible: list[bool]
    ) -> tuple[list[int], float]:
        tilings = self.learning.tilings
        if not visible[m]:
            return [self.grid + 2 * k + self.sides[m] for k in range(tilings)], 0.0
        target = MODULES[m].target
        distance, bearing = (
            observation[target + contract.DISTANCE],
            observation[target + contract.BEARING],
        )
        low = np.array([0.0, -self.range[1]])
        position = (np.array([distance, bearing]) - low) / (self.range - low) * self.counts
        position = np.clip(position, 0.0, self.counts)
        cells = np.minimum(np.floor(position + self.offsets), self.counts).astype(int)
        rows, columns = self.counts + 1
        tiles = [(k * rows + i) * columns + j for k, (i, j) in enumerate(cells.tolist())]
        _, features = self.rbf(np.array([distance, abs(bearing)]))
        return tiles, float(features @ self.agents[self.agent].potentials[m].ravel())

    def _learn(self, m: int, observation: FloatArray, potential: float, following: float) -> None:
        meta = self.agents[self.agent].meta_parameters[m]
        theta = self.theta[self.agent, m]
        reward = 1.0 if observation[MODULES[m].success] > 0.0 else 0.0
        delta = reward + meta.gamma * potential - self.potential + meta.gamma * following
        delta -= theta[self.tiles, self.chosen].sum()
        theta += meta.alpha / self.learning.tilings * delta * self.e

    def _write_action(self, action: FloatArray) -> None:
        module = MODULES[self.module]
        speed, turn = self.moves[self.chosen]
        action[contract.WHEEL_LEFT] = speed - 0.5 * self.rodent.track_m * turn
        action[contract.WHEEL_RIGHT] = speed + 0.5 * self.rodent.track_m * turn
        action[contract.JAW] = float(module.name in self.learning.jaw_modules)
        action[contract.LED : contract.LED + 3] = module.lamp
        action[contract.BEACON] = float(module.beacon and self.refractory_left[self.module] == 0)
        action[contract.TTL] = self.learning.action_ttl_s
