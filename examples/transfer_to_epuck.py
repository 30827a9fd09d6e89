"""Do agents that evolved in our arena learn to forage in a world that none of us wrote?

python examples/transfer_to_epuck.py runs/thesis/implicit --steps 1200 --out transfer.csv

One agent of every run of a sweep lives in a simulated e-puck in Aseba's own simulator (`apt-get install aseba`): as a
learner, newborn with nothing learnt, and as a policy: with what the same agent has learnt in our arena, and learning no
more. Beside them an agent of the first generation, which has not evolved, learns. Their energy is held at one level, so
that they want to forage. What is compared, in pairs, is the energy taken from feeders.
"""

import argparse
import csv
import os
import socket
import subprocess
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import msgspec
import numpy as np
from crcolony_bridge.aseba.driver import AsebaRobot
from crcolony_bridge.attached_bodies import body_settings
from crcolony_bridge.charge import ChargeMeter
from crcolony_bridge.driver_body import DriverBody
from crcolony_bridge.errors import DeviceLostError
from scipy.stats import bootstrap, wilcoxon

from crcolony.body import contract
from crcolony.config import CONFIG_FILE, Config, load
from crcolony.in_process.colony import InProcessColony
from crcolony.results.earlier_run import EarlierRun, read_earlier_run
from crcolony.robot.batch import step_parameters
from crcolony.robot.factory import make_robots, numbered_streams
from crcolony.robot.robot import Robot
from crcolony.robot.state import Robots

PERIOD_S, ENERGY = 0.1, 0.3
AT_ONCE = 10
FEEDERS_CM = ((25, 25), (75, 25), (25, 75), (75, 75))
_starting = threading.Lock()


def main() -> None:
    """Run all lives, write them, and print the statistics."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sweep", type=Path, help="folder with the runs of a condition (seed-1 …)")
    parser.add_argument("--steps", type=int, default=1200, help="control steps of a life")
    parser.add_argument("--out", type=Path, default=Path("transfer.csv"))
    options = parser.parse_args()
    folders = sorted(path.parent for path in options.sweep.glob(f"seed-*/{CONFIG_FILE}"))
    if not folders:
        parser.error(f"{options.sweep}: no runs in it")
    lives = []
    for folder in folders:
        lives += [(folder, kind, robot) for kind, robot in trio_of(folder, options.steps).items()]
        print(f"{folder.name}: prepared", flush=True)
    with ThreadPoolExecutor(AT_ONCE) as pool:
        curves = list(pool.map(lambda life: live(life[2], options.steps), lives))
    with options.out.open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["run", "kind", "step", "energy"])
        for (folder, kind, _), curve in zip(lives, curves, strict=True):
            table.writerows(
                (folder.name, kind, step, f"{curve[:step].sum():.4f}")
                for step in range(100, len(curve) + 1, 100)
            )
    by_kind: dict[str, list[np.ndarray]] = {}
    for (_, kind, _), curve in zip(lives, curves, strict=True):
        by_kind.setdefault(kind, []).append(curve)
    report({kind: np.array(of_kind) for kind, of_kind in by_kind.items()})


def trio_of(folder: Path, steps: int) -> dict[str, tuple[Robot, Robots, Config]]:
    """Return the first agent of a run's first robot as a learner, and as a policy; and as it was at the beginning."""
    config, run = load(folder / CONFIG_FILE), read_earlier_run(folder)
    life = msgspec.structs.replace(config.life, agents=1, slices=1, slice_steps=100_000)
    config = msgspec.structs.replace(config, life=life)
    colony = InProcessColony(config, lambda event: None, run.beginning(config).founders)
    colony.start()
    colony.run(steps)
    learner, policy = lone_robot(config, run), lone_robot(config, run)
    robots = policy[1]
    robots.weights[0] = colony.batch.weights[0]
    robots.module_steps[0] = colony.batch.module_steps[0]  # explores as little as at the end
    names = [gene.name for gene in policy[0].subpopulation.schema.genes]
    for column, name in enumerate(names):
        if name.endswith(".alpha"):
            robots.genotypes[0, :, column] = 0.0
    founder = lone_robot(config, read_earlier_run(folder, 0))
    return {"learner": learner, "policy": policy, "founder": founder}


def lone_robot(config: Config, run: EarlierRun) -> tuple[Robot, Robots, Config]:
    """Return a newborn robot with one agent."""
    batch, _, (robot,) = make_robots(
        config, ["0"], numbered_streams(config.seed, 0, 1), run.beginning(config).founders
    )
    robot.start()
    return robot, batch, config


def live(made: tuple[Robot, Robots, Config], steps: int) -> np.ndarray:
    """Let a robot live in an e-puck of its own; return the energy that it took in every step (steps,)."""
    robot, batch, config = made
    with tempfile.TemporaryDirectory() as folder:
        port, simulator = start_simulator(Path(folder))
        try:
            driver = AsebaRobot(f"tcp:127.0.0.1:{port}")
            driver.open()
            body = DriverBody(driver, PERIOD_S)
            settings = body_settings(driver.description)
            robot.set_parameters(step_parameters(config.learning, config.life, settings))
            meter, taken = ChargeMeter(), np.zeros(steps)
            for step in range(steps):
                row = body.read()
                taken[step] = row[contract.CHARGE] = meter.update(float(row[contract.BATTERY]))
                batch.energies[0] = ENERGY
                body.act(robot.step(row))
            body.close()
        finally:
            simulator.kill()
            simulator.wait()
    return taken


def start_simulator(folder: Path) -> tuple[int, "subprocess.Popen[bytes]"]:
    """Start a walled world with feeders and one e-puck; return the port of the robot."""
    with _starting, socket.create_server(("127.0.0.1", 0)) as found:
        port = found.getsockname()[1]
    feeders = "".join(f'<feeder x="{x}" y="{y}"/>' for x, y in FEEDERS_CM)
    (folder / "world.playground").write_text(
        '<!DOCTYPE aseba-playground><aseba-playground><color name="wall" r="0.9" g="0.9" b="0.9"/>'
        f'<world w="100" h="100" color="wall"/>{feeders}'
        f'<robot type="e-puck" port="{port}" x="50" y="50" angle="0" nodeId="1" name="puck"/>'
        "</aseba-playground>"
    )
    simulator = subprocess.Popen(
        ["asebaplayground", str(folder / "world.playground")],
        env={"PATH": os.environ["PATH"], "HOME": str(folder), "QT_QPA_PLATFORM": "offscreen"},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    for _ in range(100):
        try:
            socket.create_connection(("127.0.0.1", port), 0.1).close()
        except OSError:
            time.sleep(0.1)
        else:
            time.sleep(0.2)  # the simulator notices that this was nobody
            return port, simulator
    simulator.kill()
    raise DeviceLostError("the simulator does not listen")


def report(curves: dict[str, np.ndarray]) -> None:
    """Print the energy taken in each quarter of a life, and the paired difference."""
    for kind, taken in curves.items():
        quarters = [part.sum(axis=1).mean() for part in np.array_split(taken, 4, axis=1)]
        print(f"{kind:8}", " ".join(f"{quarter:6.3f}" for quarter in quarters), "a quarter")
    steps = curves["learner"].shape[1]
    for other in ("policy", "founder"):
        for name, part in (("whole life", slice(None)), ("second half", slice(steps // 2, None))):
            differences = (curves["learner"] - curves[other])[:, part].sum(axis=1)
            interval = bootstrap((differences,), np.mean, rng=1).confidence_interval
            better = np.mean(differences > 0) + 0.5 * np.mean(differences == 0)
            p = wilcoxon(differences).pvalue if differences.any() else 1.0
            print(
                f"learner - {other}, {name}: {differences.mean():+.3f}"
                f" ({interval.low:+.3f} to {interval.high:+.3f}), n = {len(differences)},"
                f" better in {better:.0%} of pairs, Wilcoxon p = {p:.3g}"
            )


if __name__ == "__main__":
    main()
