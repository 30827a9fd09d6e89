"""Robot-steps a second of the whole colony step on one core, what they are spent on, and two colonies in two processes.

Run with `make bench`, or `python -m tests.benchmarks.bench_colony`. A robot-step is one control step of one robot:
pymunk physics, senses, selector, learning, encounters. Agents do not starve here, so no robot-step is idle.
"""

import statistics
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor

from crcolony.compiled import FloatArray, compiled
from crcolony.config import load
from crcolony.in_process.colony import InProcessColony, tick
from crcolony.robot.state import Robots, StepParameters
from crcolony.robot.step import step_robots
from crcolony.world.physics import move_bodies
from crcolony.world.state import World
from crcolony.world.tick import observe

TARGETS = {4: 1.0, 20: 1.0, 100: 0.7, 1000: 0.45}
REPEATS = 7
ROBOT_STEPS = 200_000


@compiled
def run_whole(
    world: World, robots: Robots, parameters: StepParameters, actions: FloatArray, ticks: int
) -> int:
    events = 0
    for _ in range(ticks):
        events += tick(world, robots, parameters, actions)
    return events


@compiled
def run_physics(world: World, ticks: int) -> None:
    step_s = world.rules.period_s / world.rules.physics_steps
    for _ in range(ticks * world.rules.physics_steps):
        move_bodies(
            world.physics,
            world.poses,
            world.velocities,
            world.wheel_speeds,
            world.rules.track_m,
            step_s,
        )


@compiled
def run_senses(world: World, ticks: int) -> None:
    for _ in range(ticks):
        observe(world)


@compiled
def run_learning(
    world: World, robots: Robots, parameters: StepParameters, actions: FloatArray, ticks: int
) -> None:
    for _ in range(ticks):
        step_robots(
            robots, parameters, world.observations[world.observations.shape[0] - 1], actions
        )


def new_colony(robots: int, *settings: str) -> InProcessColony:
    """Return a colony that has lived for a while, whose agents neither starve nor hand over."""
    config = load(None, [f"robots={robots}", "life.energy_per_step=0", *settings])
    colony = InProcessColony(config, lambda _: None)
    colony.start()
    colony.batch.slice_steps_left[:] = 2**60
    colony_step(colony, 300)()
    return colony


def colony_step(colony: InProcessColony, ticks: int) -> Callable[[], object]:
    world, robots, parameters = colony.arena.world, colony.batch, colony.parameters
    return lambda: run_whole(world, robots, parameters, colony.actions, ticks)


def seconds(run: Callable[[], object]) -> float:
    """Return the median time of a call."""
    run()
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def report(robots: int, *settings: str) -> None:
    colony = new_colony(robots, *settings)
    ticks = max(1, ROBOT_STEPS // robots)
    world, batch, parameters = colony.arena.world, colony.batch, colony.parameters
    whole = seconds(colony_step(colony, ticks))
    parts = {
        "physics": seconds(lambda: run_physics(world, ticks)),
        "senses": seconds(lambda: run_senses(world, ticks)),
        "learning": seconds(lambda: run_learning(world, batch, parameters, colony.actions, ticks)),
    }
    parts["rest"] = whole - sum(parts.values())
    ns = {name: 1e9 * part / (ticks * robots) for name, part in parts.items()}
    print(
        f"{robots:5d} robots  {ticks * robots / whole / 1e6:5.2f} million robot-steps/s"
        f"  (target {TARGETS[robots]:.2f})   ns a robot-step: "
        + "  ".join(f"{name} {value:.0f}" for name, value in ns.items()),
        flush=True,
    )


def one_process(robots: int) -> float:
    colony = new_colony(robots)
    return 1.0 / seconds(colony_step(colony, ROBOT_STEPS // robots))


def whole_run(robots: int = 4, generations: int = 20) -> float:
    """Return robot-steps a second of a default run with its matings, hand-overs, turnovers and history."""
    import tempfile
    from pathlib import Path

    from crcolony.in_process.run import run_until_done, start_run

    with tempfile.TemporaryDirectory() as folder:
        results, colony = start_run(Path(folder), load(None, [f"generations={generations}"]))
        start = time.perf_counter()
        run_until_done(results, colony, lambda: False, lambda _: None)
        rate = colony.tick * robots / (time.perf_counter() - start)
        results.close()
    return rate


def main() -> None:
    print("bare colony step, one core, all figures medians")
    for robots in TARGETS:
        report(robots)
    print("every sense switched on")
    for robots in TARGETS:
        report(robots, "body.infrared=true", "body.inertial=true", "body.microphones=true")
    bare = ROBOT_STEPS * one_process(4)
    whole = statistics.median(whole_run() for _ in range(3))
    print(
        f"the whole default run, with results folder: {whole / 1e6:.2f} million robot-steps/s,"
        f" {bare / whole:.2f} times slower than the bare step"
    )
    with ProcessPoolExecutor(2) as executor:
        single = executor.submit(one_process, 4).result()
        both = sum(executor.map(one_process, [4, 4]))
    print(f"two colonies in two processes: {both / single:.2f} times one")


if __name__ == "__main__":
    main()
