"""How long a genotype takes by infrared, and how soon two robots that face each other have a contact.

Run with `make bench`, or `python -m tests.benchmarks.bench_infrared`. Two emulated controllers run the reference
firmware. Messages differ by their size and by the share of bytes that are lost on the way; contacts are measured with
firmware whose infrared carries whole messages (the baseline), and with one that carries words of 11 bits alone.
"""

import contextlib
import os
import random
import statistics
import tempfile
import time
from pathlib import Path

import numpy as np
from crcolony_bridge.attached_bodies import AttachedBodies
from crcolony_bridge.attached_robot import AttachedRobot
from crcolony_bridge.infrared.ir_messages import seal
from crcolony_bridge.reference_firmware.driver import SerialFirmware

from crcolony.body import contract
from crcolony.protocol.body_messages import Action, decode_observation, pack_row
from tests.robot_firmware_bridge.emulated_robot import AvrRobot
from tests.robot_firmware_bridge.firmware import WORDS_ALONE
from tests.robot_firmware_bridge.ir_air import IrAir, ir_air

SIZES = (33, 382, 640)
"""Bytes: a beacon alone, a Pogobot's frame, an envelope with a default genotype"""
LOSSES = (0.0, 0.01, 0.03)
PAIR = (bytes(range(16)), bytes(range(1, 17)))
CONTROL_S, MEETINGS = 0.1, 10


def main() -> None:
    """Measure all, and print the figures."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for size in SIZES:
            for loss in LOSSES:
                seconds = measure_message(folder, size, loss)
                print(
                    f"{size} bytes by infrared, {loss:.0%} of bytes lost: {seconds:.2f} s (median of 5)"
                )
        for form, defines in (("messages", ""), ("words of 11 bits", WORDS_ALONE)):
            measure_contacts(folder, form, defines)


class LossyAir(IrAir):
    """Loses bytes at random."""

    def __init__(self, links: list[Path], loss: float) -> None:
        self._loss, self._random = loss, random.Random(1)
        super().__init__(links)

    def _through(self, data: bytes) -> bytes:
        return bytes(byte for byte in data if self._random.random() >= self._loss)


def measure_message(folder: Path, size: int, loss: float) -> float:
    """Return how long a message of this size takes from one robot to another (s, median of five)."""
    robots = [AvrRobot(folder, f"ir-{k}", k + 1) for k in range(2)]
    air = LossyAir([robot.ir_link for robot in robots], loss)
    drivers = [SerialFirmware(str(robot.host_link)) for robot in robots]
    took = []
    try:
        for driver in drivers:
            driver.open()
        beacon = np.zeros(contract.ACTION_WIDTH)
        beacon[contract.BEACON], beacon[contract.TTL] = 1.0, 0.5
        for _ in range(5):
            message = os.urandom(size - len(seal(b"")))
            began_s = time.perf_counter()
            assert drivers[0].send_ir(message)
            while True:
                drivers[0].write(beacon)
                drivers[0].read(0.0)
                reading = drivers[1].read(0.02)
                if reading is not None and message in reading.ir_messages:
                    break
            took.append(time.perf_counter() - began_s)
    finally:
        for driver in drivers:
            driver.close()
        air.close()
        for robot in robots:
            robot.switch_off()
    return statistics.median(took)


def measure_contacts(folder: Path, name: str, defines: str) -> None:
    """Print how soon two robots with this firmware have a contact, from facing each other on, at 10 Hz."""
    with contextlib.ExitStack() as opened:
        robots = [
            opened.enter_context(AvrRobot(folder, f"meet-{k}", k + 1, defines)) for k in range(2)
        ]
        air = opened.enter_context(ir_air([robot.ir_link for robot in robots]))
        attached = [
            AttachedRobot(f"{k}", SerialFirmware(str(robot.host_link)), print)
            for k, robot in enumerate(robots)
        ]
        for body in attached:
            body.open()
            body.start()
            opened.callback(body.close)
        bodies = AttachedBodies(attached, 1, CONTROL_S)
        delays, random_ = np.array([]).reshape(0, 2), random.Random(1)
        for _ in range(MEETINGS):
            for inhabitant in PAIR:
                bodies.join(inhabitant, "bench")
            air.is_clear = False
            run_until(bodies, random_.uniform(2.0, 4.0))
            air.is_clear = True
            delays = np.vstack((delays, run_until(bodies, 60.0)))
            for inhabitant in PAIR:
                bodies.leave(inhabitant)
    later, apart = delays.max(axis=1), np.abs(np.diff(delays, axis=1))
    print(
        f"from facing each other to a contact by {name}: {np.median(later):.1f} s (median of {MEETINGS}), at most"
        f" {later.max():.1f} s; that of the other side {np.median(apart):.1f} s before, at most {apart.max():.1f} s"
    )


def run_until(bodies: AttachedBodies, within_s: float) -> list[float]:
    """Let both robots keep their beacons on until both have a contact; return after how long each has it (s)."""
    row = np.zeros(contract.ACTION_WIDTH)
    row[contract.BEACON], row[contract.TTL] = 1.0, 0.5
    began_s = time.monotonic()
    found: dict[bytes, float] = {}
    while len(found) < len(PAIR) and time.monotonic() - began_s < within_s:
        for robot in bodies.step(time.monotonic(), PAIR):
            observation = decode_observation(bodies.observation(robot))
            bodies.apply_action(robot, Action(observation.tick, pack_row(row)))
            if observation.contact is not None:
                found.setdefault(robot, time.monotonic() - began_s)
        time.sleep(CONTROL_S)
    return [found.get(robot, within_s) for robot in PAIR]


if __name__ == "__main__":
    main()
