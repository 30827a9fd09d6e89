"""The compiled control step does what the textbook does, alone and in a batch."""

import msgspec
import numpy as np
import pytest

from crcolony.body import contract
from crcolony.robot.robot import Robot
from crcolony.robot.settings import Heredity
from crcolony.robot.state import DIED, MET, SLICE_OVER, Robots
from crcolony.robot.step import select_module, step_robots
from tests.support.oracles.plain_robot import PlainRobot, PlainStream
from tests.support.small_robots import DEFAULT, Settings, new_robots, nothing, observation


def plain_twin(batch: Robots, settings: Settings) -> PlainRobot:
    """Return the textbook's version of the first robot of a batch, as it is before its first step."""
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
    ],
)
def test_a_life_is_that_of_the_textbook(seed: int, changes: dict[str, object]) -> None:
    """Same actions, same energy, and weights equal to 1e-9, over whole slices of several agents."""
    learning = msgspec.structs.replace(DEFAULT.learning, **changes)
    settings = Settings(learning=learning)
    batch, _, (robot,) = new_robots(1, settings, seed)
    robot.start()
    plain = plain_twin(batch, settings)
    plain.take_over(robot.agent)
    rng = np.random.default_rng(seed)
    modules = set()
    for _ in range(settings.life.agents * settings.life.slices * settings.life.slice_steps):
        seen = observation(rng)
        done = robot.step(seen)
        np.testing.assert_array_equal(done, plain.step(seen))
        modules.add(plain.module)
        if robot.events & SLICE_OVER:
            np.testing.assert_allclose(batch.weights[0], plain.theta, rtol=0.0, atol=1e-9)
            np.testing.assert_array_equal(batch.energies[0], plain.energy)
            if robot.hand_over():
                plain.stream.counter = int(batch.streams[0, 1])
                plain.take_over(robot.agent)
    assert {0, 1} <= modules
    assert np.abs(batch.weights[0]).max() > 0.1


def step_all(robots: list[Robot], rows: np.ndarray) -> np.ndarray:
    return np.array([robot.step(row).copy() for robot, row in zip(robots, rows, strict=True)])


def test_a_batch_of_n_is_n_batches_of_one() -> None:
    """Bit for bit: actions, events, weights, randomness."""
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
        rows = np.array([observation(rng) for _ in range(count)])
        step_robots(batch, parameters, rows, actions)
        alone_actions = step_all([alone for _, alone in singles], rows)
        assert np.array_equal(actions, alone_actions)
        for row, (_single, alone) in enumerate(singles):
            assert robots[row].events == alone.events
            if alone.events & SLICE_OVER:
                assert robots[row].hand_over() == alone.hand_over()
    for row, (single, _) in enumerate(singles):
        for name in ("weights", "traces", "energies", "streams", "used", "captures"):
            assert np.array_equal(getattr(batch, name)[row], getattr(single, name)[0]), name


def test_energy_is_spent_and_regained_and_ends_in_death() -> None:
    """A step costs, a charge fills to 1 at most, and at 0 the agent dies once, stands and learns no more."""
    batch, _, (robot,) = new_robots(
        1,
        Settings(
            life=msgspec.structs.replace(DEFAULT.life, energy_per_step=0.125, initial_energy=0.5)
        ),
    )
    robot.start()
    robot.step(nothing())
    assert robot.energy == 0.375
    fed = nothing()
    fed[contract.CHARGE] = 0.9
    robot.step(fed)
    assert robot.energy == 0.875
    assert batch.captures[0, robot.agent] == 1
    events = []
    for _ in range(12):
        action = robot.step(nothing())
        events.append(robot.events)
    assert events.count(DIED) == 1
    assert events[6] == DIED
    assert robot.energy == 0.0
    assert not action.any()
    assert batch.steps_alive[0, robot.agent] == 9
    weights = batch.weights.copy()
    for _ in range(5):
        assert not robot.step(fed).any()
    assert robot.energy == 0.0
    assert np.array_equal(batch.weights, weights)


def test_a_pack_that_is_still_held_is_captured_later() -> None:
    """Charge counts as energy at once, as a capture when the jaw is empty again."""
    batch, _, (robot,) = new_robots(1)
    robot.start()
    held = nothing()
    held[contract.CHARGE], held[contract.JAW_HOLDS] = 0.1, 1.0
    robot.step(held)
    assert batch.captures[0, robot.agent] == 0
    held[contract.JAW_HOLDS] = 0.0
    robot.step(held)
    assert batch.captures[0, robot.agent] == 1


def always_mating(batch: Robots) -> None:
    """Let the selector of all agents choose the mating module, whatever they see."""
    batch.genotypes[:, :, :4] = [1.0, 0.0, 0.0, 0.0]


def test_after_a_mating_the_beacon_rests() -> None:
    """It is off, and faces count as not visible, for the refractory steps; then it is on again."""
    batch, _, (robot,) = new_robots(1)
    robot.start()
    always_mating(batch)
    face = nothing()
    face[contract.FACE], face[contract.FACE + contract.DISTANCE] = 1.0, 0.4
    assert robot.step(face)[contract.BEACON] == 1.0
    met = face.copy()
    met[contract.ENCOUNTER] = 1.0
    beacons, unseen = [], []
    for row in (met, face, face, face, face, face):
        beacons.append(robot.step(row)[contract.BEACON])
        unseen.append(batch.visible[1] == 0.0)
    assert beacons == [0.0, 0.0, 0.0, 0.0, 1.0, 1.0]
    assert unseen == [True, True, True, True, False, False]
    assert batch.matings[0, robot.agent] == 1


def test_only_the_mating_module_switches_the_beacon_on() -> None:
    """Each module shows its own lamp."""
    batch, _, (robot,) = new_robots(1)
    robot.start()
    always_mating(batch)
    mating = robot.step(nothing()).copy()
    batch.genotypes[:, :, 0] = -1.0
    foraging = robot.step(nothing()).copy()
    assert (mating[contract.BEACON], foraging[contract.BEACON]) == (1.0, 0.0)
    assert mating[contract.LED : contract.LED + 3].tolist() == [1.0, 0.0, 0.0]
    assert foraging[contract.LED : contract.LED + 3].tolist() == [0.0, 1.0, 0.0]


def test_the_last_step_of_a_slice_learns_and_stops() -> None:
    """Everything owed is paid, traces are gone, and the body is told to stop at once."""
    batch, _, (robot,) = new_robots(1)
    robot.start()
    rng = np.random.default_rng(3)
    for step in range(DEFAULT.life.slice_steps):
        action = robot.step(observation(rng))
        is_last = step == DEFAULT.life.slice_steps - 1
        assert bool(robot.events & SLICE_OVER) == is_last
    assert not action.any()
    assert batch.clock[0].tolist() == [1.0, 0.0, 0.0]
    assert not batch.traces[0, :, 1].any()


def test_an_encounter_is_an_event_of_that_step_alone() -> None:
    """The colony is told once."""
    _, _, (robot,) = new_robots(1)
    robot.start()
    met = nothing()
    met[contract.ENCOUNTER] = 1.0
    robot.step(met)
    assert robot.events == MET
    robot.step(nothing())
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
def test_the_selector_takes_mating_when_its_output_is_above_zero(
    genes: list[float], energy: float, visible: list[float], module: int
) -> None:
    """Bias, energy, and what is visible, weighed by the genes; without any reason the robot forages."""
    assert select_module(np.array(genes), energy, np.array(visible), 2) == module


def test_without_shaping_no_potential_moves_learning() -> None:
    """All potential genes are 0 and stay 0, in newborns and in mutants."""
    learning = msgspec.structs.replace(DEFAULT.learning, shaping=False)
    batch, _, (robot,) = new_robots(1, Settings(learning=learning, heredity=Heredity()))
    robot.start()
    rng = np.random.default_rng(5)
    for _ in range(20):
        robot.step(observation(rng))
        assert batch.potential[0] == 0.0
    robot.turn_over()
    names = [gene.name for gene in robot.subpopulation.schema.genes]
    places = [k for k, name in enumerate(names) if ".potential." in name]
    assert len(places) == 32
    assert not batch.genotypes[0][:, places].any()
