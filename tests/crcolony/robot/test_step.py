"""The compiled control step does what the textbook does, alone and in a batch."""

import msgspec
import numpy as np
import pytest

from crcolony.body import contract
from crcolony.compiled import FloatArray
from crcolony.learning.features import NormalizedRBF, TileCoding
from crcolony.learning.sarsa_learner import SarsaLambda
from crcolony.learning.shaping import PotentialShaping
from crcolony.randomness import draw
from crcolony.robot.genes import TAU_DECAY, decode
from crcolony.robot.robot import Robot
from crcolony.robot.settings import Heredity
from crcolony.robot.state import DIED, MET, SLICE_OVER, Robots
from crcolony.robot.step import select_module, step_robots
from crcolony.robot.weight_rows import SAVED_APART, save_weights, weights_by_tile
from tests.support.oracles.plain_robot import PlainRobot, PlainStream
from tests.support.small_robots import (
    DEFAULT,
    Settings,
    empty_observation,
    new_robots,
    random_observation,
)


def plain_robot(batch: Robots, settings: Settings) -> PlainRobot:
    """Return the textbook's version of the first robot of a batch, before its first step."""
    key, counter = (int(number) for number in batch.streams[0])
    stream = PlainStream(key, counter)
    return PlainRobot(batch.genotypes[0], stream, settings.learning, settings.life, settings.rodent)


@pytest.mark.parametrize(
    ("seed", "changes"),
    [
        (1, {}),
        (2, {}),
        (3, {}),
        (4, {"initial_value": 0.5}),
        (5, {"shaping": False}),
        (6, {"tilings": 1, "potential_distances": 1, "speeds_m_s": (0.2,)}),
        (7, {"visible_mates": "any", "jaw_modules": ("foraging", "mating")}),
        (8, {"visible_mates": "ready", "jaw_modules": ()}),
    ],
)
def test_steps_are_those_of_the_textbook(seed: int, changes: dict[str, object]) -> None:
    """Actions and energies are the same, and weights as far as 32 bits hold them, over whole slices
    of several agents."""
    learning = msgspec.structs.replace(DEFAULT.learning, **changes)
    settings = Settings(learning=learning)
    batch, parameters, (robot,) = new_robots(1, settings, seed)
    initial_weight = parameters.initial_weight
    robot.start()
    plain = plain_robot(batch, settings)
    plain.hand_over(robot.agent)
    rng = np.random.default_rng(seed)
    modules = set()
    for _ in range(settings.life.agents * settings.life.slices * settings.life.slice_steps):
        observation = random_observation(rng)
        action = robot.step(observation)
        np.testing.assert_array_equal(action, plain.step(observation))
        modules.add(plain.module)
        if robot.events & SLICE_OVER:
            weights = weights_by_tile(batch, 0, initial_weight)
            np.testing.assert_allclose(weights, plain.theta, rtol=0.0, atol=1e-5)
            np.testing.assert_array_equal(batch.energies[0], plain.energy)
            if robot.hand_over():
                plain.stream.counter = int(batch.streams[0, 1])
                plain.hand_over(robot.agent)
    assert {0, 1} <= modules
    assert np.abs(weights).max() > 0.1


@pytest.mark.parametrize("seed", range(4))
def test_learning_is_that_of_the_library(seed: int) -> None:
    """With one module in control, the same episode gives `SarsaLambda` the same actions, and
    weights equal to 1e-12.

    The library's loop and the robot's step are two compositions of the same functions of Algorithm
    2.2.
    """
    settings = Settings(life=msgspec.structs.replace(DEFAULT.life, slice_steps=500))
    batch, parameters, (robot,) = new_robots(1, settings, seed)
    robot.start()
    batch.genotypes[0, :, :4] = [-1.0, 0.0, 0.0, 0.0]
    batch.genotypes[0, :, parameters.selector_genes + TAU_DECAY] = 0.0
    learning, range_m = settings.learning, settings.rodent.camera_range_m
    agent = decode(batch.genotypes[0, robot.agent], learning)
    meta = agent.meta_parameters[0]
    high = np.array([range_m, settings.rodent.camera_half_angle_rad])
    coding = TileCoding(parameters.low, high, parameters.tile_counts, parameters.tile_offsets)
    actions = len(parameters.wheel_speeds)
    learner = SarsaLambda(coding, actions, meta.alpha, meta.gamma, meta.lambda_, meta.tau)
    network = NormalizedRBF.grid(
        np.zeros(2),
        high,
        np.array([learning.potential_distances, learning.potential_bearings]),
    )
    shaping = PotentialShaping(network, agent.potentials[0].ravel(), meta.gamma)
    stream = robot.stream.copy()
    rng = np.random.default_rng(seed)
    last: FloatArray | None = None
    for _ in range(settings.life.slice_steps):
        state = np.array([rng.uniform(0.0, range_m), rng.uniform(-1.4, 1.4)])
        reward = float(rng.random() < 0.1)
        observation = empty_observation()
        observation[contract.PACK], observation[contract.CHARGE] = 1.0, reward
        observation[contract.PACK + 1 : contract.PACK + 3] = state
        robot.step(observation)
        if last is None:
            selected = learner.start(state, draw(stream))
        else:
            reward += shaping(np.abs(last), np.abs(state), False)
            selected = learner.step(reward, state, False, draw(stream))
        assert batch.action[0] == selected
        last = state
    assert np.array_equal(stream, robot.stream)
    weights = weights_by_tile(batch, 0, 0.0)[robot.agent, 0, : coding.size]
    assert np.abs(weights).max() > 0.1
    np.testing.assert_allclose(weights, learner.weights(), rtol=0.0, atol=1e-6)


def step_all(robots: list[Robot], rows: np.ndarray) -> np.ndarray:
    """Step robots of batches of one; return their actions."""
    return np.array([robot.step(row).copy() for robot, row in zip(robots, rows, strict=True)])


def test_a_batch_of_n_is_n_batches_of_one() -> None:
    """Actions, events, weights and random streams are equal, bit for bit."""
    count = 4
    batch, parameters, robots = new_robots(count)
    singles = []
    for row, robot in enumerate(robots):
        robot.start()
        single, _, (alone,) = new_robots(1)
        single.streams[0] = batch.streams[row]
        saved = robot.save()
        alone.restore(saved)
        singles.append((single, alone))
    rng = np.random.default_rng(7)
    actions = np.zeros((count, contract.ACTION_WIDTH))
    for _ in range(200):
        rows = np.array([random_observation(rng) for _ in range(count)])
        step_robots(batch, parameters, rows, actions)
        alone_actions = step_all([alone for _, alone in singles], rows)
        assert np.array_equal(actions, alone_actions)
        for row, (_single, alone) in enumerate(singles):
            assert robots[row].events == alone.events
            if alone.events & SLICE_OVER:
                assert robots[row].hand_over() == alone.hand_over()
    for row, (single, _) in enumerate(singles):
        for name in ("energies", "streams", "module_steps", "captures"):
            assert np.array_equal(getattr(batch, name)[row], getattr(single, name)[0]), name
        learnt, alone_learnt = save_weights(batch, row), save_weights(single, 0)
        for name in SAVED_APART:
            assert np.array_equal(learnt[name], alone_learnt[name]), name


def test_an_agent_without_energy_dies() -> None:
    """A step costs energy, a charge adds some, and at 0 the agent dies once, stops and learns no
    more."""
    batch, _, (robot,) = new_robots(
        1,
        Settings(
            life=msgspec.structs.replace(DEFAULT.life, energy_per_step=0.125, initial_energy=0.5)
        ),
    )
    robot.start()
    robot.step(empty_observation())
    assert robot.energy == 0.375
    charged = empty_observation()
    charged[contract.CHARGE] = 0.9
    robot.step(charged)
    assert robot.energy == 0.875
    assert batch.captures[0, robot.agent] == 1
    events = []
    for _ in range(12):
        action = robot.step(empty_observation())
        events.append(robot.events)
    assert events.count(DIED) == 1
    assert events[6] == DIED
    assert robot.energy == 0.0
    assert not action.any()
    assert batch.steps_alive[0, robot.agent] == 9
    weights = batch.weights.copy()
    for _ in range(5):
        assert not robot.step(charged).any()
    assert robot.energy == 0.0
    assert np.array_equal(batch.weights, weights)


def test_a_pack_counts_as_captured_when_it_is_empty() -> None:
    """Its charge counts as energy at once, but as a capture only when the jaw no longer holds
    it."""
    batch, _, (robot,) = new_robots(1)
    robot.start()
    held = empty_observation()
    held[contract.CHARGE], held[contract.JAW_HOLDS] = 0.1, 1.0
    robot.step(held)
    assert batch.captures[0, robot.agent] == 0
    held[contract.JAW_HOLDS] = 0.0
    robot.step(held)
    assert batch.captures[0, robot.agent] == 1


def select_mating_always(batch: Robots) -> None:
    """Make the selector of all agents select the mating module, whatever is visible."""
    batch.genotypes[:, :, :4] = [1.0, 0.0, 0.0, 0.0]


def seen_face(*lamp: float) -> FloatArray:
    """Return an observation of a face with a lamp of this colour (red, green, blue), 0.4 m away."""
    row = empty_observation()
    row[contract.FACE], row[contract.FACE + contract.DISTANCE] = 1.0, 0.4
    row[contract.FACE + contract.COLOUR : contract.FACE + contract.COLOUR + 3] = lamp
    return row


@pytest.mark.parametrize(
    ("visible_mates", "dead", "foraging", "mating"),
    [("any", True, True, True), ("lit", False, True, True), ("ready", False, False, True)],
)
def test_a_face_counts_as_a_mate_by_its_lamp(
    visible_mates: str, dead: bool, foraging: bool, mating: bool
) -> None:
    """A dead robot's face, which is dark, attracts nobody; by a setting neither does one that
    forages."""
    learning = msgspec.structs.replace(DEFAULT.learning, visible_mates=visible_mates)
    batch, _, (robot,) = new_robots(1, Settings(learning=learning))
    robot.start()
    seen = []
    for lamp in ((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)):
        robot.step(seen_face(*lamp))
        seen.append(bool(batch.visible[0, 1]))
    assert seen == [dead, foraging, mating]


@pytest.mark.parametrize("modules", [(), ("foraging",), ("mating",), ("foraging", "mating")])
def test_the_jaw_closes_in_the_modules_that_are_set(modules: tuple[str, ...]) -> None:
    """It is a reflex of each of them, and open in the others."""
    learning = msgspec.structs.replace(DEFAULT.learning, jaw_modules=modules)
    batch, _, (robot,) = new_robots(1, Settings(learning=learning))
    robot.start()
    select_mating_always(batch)
    closes = {"mating": robot.step(empty_observation())[contract.JAW]}
    batch.genotypes[:, :, 0] = -1.0
    closes["foraging"] = robot.step(empty_observation())[contract.JAW]
    assert closes == {name: float(name in modules) for name in ("foraging", "mating")}


def test_a_mating_is_followed_by_the_refractory_time() -> None:
    """The beacon is off, and faces count as not visible, for the refractory steps; then it is on
    again."""
    batch, _, (robot,) = new_robots(1)
    robot.start()
    select_mating_always(batch)
    face = seen_face(1.0, 0.0, 0.0)
    assert robot.step(face)[contract.BEACON] == 1.0
    met = face.copy()
    met[contract.ENCOUNTER] = 1.0
    beacons, hidden = [], []
    for row in (met, face, face, face, face, face):
        beacons.append(robot.step(row)[contract.BEACON])
        hidden.append(batch.visible[0, 1] == 0.0)
    assert beacons == [0.0, 0.0, 0.0, 0.0, 1.0, 1.0]
    assert hidden == [True, True, True, True, False, False]
    assert batch.matings[0, robot.agent] == 1


def test_the_energy_at_every_mating_is_summed() -> None:
    """That is the number of offspring to expect; the energy of other steps does not count."""
    batch, _, (robot,) = new_robots(1)
    robot.start()
    met = empty_observation()
    met[contract.ENCOUNTER] = 1.0
    expected = 0.0
    for k in range(12):
        robot.step(met if k % 3 == 0 else empty_observation())
        expected += robot.energy if k % 3 == 0 else 0.0
    assert batch.matings[0, robot.agent] == 4
    assert batch.mating_energy_sum[0, robot.agent] == expected < 4 * 0.5


def test_only_the_mating_module_switches_the_beacon_on() -> None:
    """Each module shows its own lamp."""
    batch, _, (robot,) = new_robots(1)
    robot.start()
    select_mating_always(batch)
    mating = robot.step(empty_observation()).copy()
    batch.genotypes[:, :, 0] = -1.0
    foraging = robot.step(empty_observation()).copy()
    assert (mating[contract.BEACON], foraging[contract.BEACON]) == (1.0, 0.0)
    assert mating[contract.LED : contract.LED + 3].tolist() == [1.0, 0.0, 0.0]
    assert foraging[contract.LED : contract.LED + 3].tolist() == [0.0, 1.0, 0.0]


def test_the_last_step_of_a_slice_learns_and_stops() -> None:
    """No update is pending, all traces are cleared, and the action stops the body."""
    batch, _, (robot,) = new_robots(1)
    robot.start()
    rng = np.random.default_rng(3)
    for step in range(DEFAULT.life.slice_steps):
        action = robot.step(random_observation(rng))
        is_last = step == DEFAULT.life.slice_steps - 1
        assert bool(robot.events & SLICE_OVER) == is_last
    assert not action.any()
    assert batch.trace_totals[0].tolist() == [1.0, 0.0, 0.0]
    assert not batch.traces[0, :, 1].any()


def test_an_encounter_is_an_event_of_that_step_alone() -> None:
    """It is reported once."""
    _, _, (robot,) = new_robots(1)
    robot.start()
    met = empty_observation()
    met[contract.ENCOUNTER] = 1.0
    robot.step(met)
    assert robot.events == MET
    robot.step(empty_observation())
    assert robot.events == 0


@pytest.mark.parametrize(
    ("genes", "energy", "visible", "module"),
    [
        ([0.0, 0.0, 0.0, 0.0], 1.0, [1.0, 1.0], 0),
        ([0.1, 0.0, 0.0, 0.0], 0.0, [0.0, 0.0], 1),
        ([-0.5, 1.0, 0.0, 0.0], 0.4, [0.0, 0.0], 0),
        ([-0.5, 1.0, 0.0, 0.0], 0.6, [0.0, 0.0], 1),
        ([0.2, 0.0, -1.0, 0.0], 0.5, [1.0, 0.0], 0),
        ([-0.2, 0.0, 0.0, 1.0], 0.5, [0.0, 1.0], 1),
    ],
)
def test_mating_is_selected_when_its_output_is_above_zero(
    genes: list[float], energy: float, visible: list[float], module: int
) -> None:
    """The output weighs bias, energy and visible targets by the genes; otherwise the robot
    forages."""
    assert select_module(np.array(genes), energy, np.array(visible), 2) == module


def test_without_shaping_there_is_no_potential() -> None:
    """All potential genes are 0, in the first generation and in mutants."""
    learning = msgspec.structs.replace(DEFAULT.learning, shaping=False)
    batch, _, (robot,) = new_robots(1, Settings(learning=learning, heredity=Heredity()))
    robot.start()
    rng = np.random.default_rng(5)
    for _ in range(20):
        robot.step(random_observation(rng))
        assert batch.potential[0] == 0.0
    robot.turn_over()
    names = [gene.name for gene in robot.subpopulation.schema.genes]
    indices = [k for k, name in enumerate(names) if ".potential." in name]
    assert len(indices) == 32
    assert not batch.genotypes[0][:, indices].any()
