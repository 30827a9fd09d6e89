"""A synthetic colony of any size that publishes what a real one does, for benchmarks of observers."""

import itertools
import time
from multiprocessing.connection import Connection

import numpy as np
import zenoh

from crcolony.config import Config
from crcolony.evolution.history import Born
from crcolony.protocol.codec import encode
from crcolony.protocol.key_expressions import ArenaKeys, ColonyKeys
from crcolony.protocol.mating_messages import Encounter
from crcolony.protocol.telemetry_messages import (
    EventMessage,
    Exchanged,
    Met,
    RobotEvent,
    RobotState,
    Scene,
    ScenePack,
    SceneRobot,
)
from crcolony.robot.genes import agent_schema
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import open_session

COLONY, ARENA = "synthetic", "synthetic"
HZ, STATES_PER_S = 10.0, 2.0
AREA_M2, AGENTS = 1.21, 20
MATINGS_PER_ROBOT_S = 0.02
"""As of evolved robots in real time, at ten periods a second."""
JUMP, SENT = b"jump", b"sent"
"""Commands: the first robot jumps to the other side, answered with the time of its publication; and how many bytes have
been published."""


class SyntheticColony:
    """Robots that move at random in a square, and publish at the rates of real ones."""

    def __init__(self, session: zenoh.Session, count: int) -> None:
        self.session, self.count = session, count
        self.rng = np.random.default_rng(count)
        self.side_m = float(np.sqrt(AREA_M2 * count))
        self.ids = [bytes([number >> 8, number & 255]) + bytes(14) for number in range(count)]
        self.places = self.rng.uniform(-0.45, 0.45, (count, 2)) * self.side_m
        self.headings = self.rng.uniform(-np.pi, np.pi, count)
        self.packs = self.rng.uniform(-0.45, 0.45, (2 * count, 2)) * self.side_m
        self.energies = self.rng.uniform(0.1, 1.0, count)
        self.seqs = [0] * count
        self.matings = [0] * count
        self.tick, self.encounters = 0, itertools.count(1)
        self.sent = 0
        """Bytes that were published"""
        self.keys, self.arena = ColonyKeys(COLONY), ArenaKeys(ARENA)
        live = session.liveliness()
        self.tokens = [
            live.declare_token(self.keys.alive(robot, 0, f"s{number}"))
            for number, robot in enumerate(self.ids)
        ]
        self.tokens.append(live.declare_token(self.arena.alive(1, "s")))

    def put(self, key: str, data: bytes) -> None:
        """Publish something."""
        self.sent += len(data)
        self.session.put(key, data)

    def publish_births(self) -> None:
        """Publish the births of every robot's agents."""
        schema = agent_schema(Config().learning, Config().heredity)
        for number, robot in enumerate(self.ids):
            for index in range(AGENTS):
                genes = schema.random(self.rng).astype("<f8").tobytes()
                agent = f"{robot.hex()}/{index}"
                self.publish_event(number, Born(0, number, 0, agent, "", genes, None, None))

    def publish_event(self, number: int, event: RobotEvent) -> None:
        self.seqs[number] += 1
        message = EventMessage(
            self.ids[number], 0, self.seqs[number], int(1000 * time.time()), event
        )
        self.put(self.keys.event(self.ids[number]), encode(message))

    def step(self) -> None:
        """Make one control period pass: all robots move, some mate, and everything is published."""
        self.tick += 1
        self.headings += self.rng.normal(0.0, 0.3, self.count)
        ahead = np.stack([np.cos(self.headings), np.sin(self.headings)], axis=1)
        self.places = np.clip(self.places + 0.03 * ahead, -0.47 * self.side_m, 0.47 * self.side_m)
        self.publish_scene()
        phase = int(HZ / STATES_PER_S)
        for number in range(self.tick % phase, self.count, phase):
            self.publish_state(number)
        for _ in range(self.rng.poisson(MATINGS_PER_ROBOT_S * self.count / 2 / HZ)):
            self.mate()

    def mate(self) -> None:
        one, other = sorted(self.rng.choice(self.count, 2, replace=False).tolist())
        encounter = Encounter(self.ids[one], self.ids[other], 0, next(self.encounters))
        for me, partner in ((one, other), (other, one)):
            self.matings[me] += 1
            own, others = (f"{self.ids[k].hex()}/{self.tick % AGENTS}" for k in (me, partner))
            self.publish_event(me, Met(self.tick, self.ids[partner], own))
            self.publish_event(me, Exchanged(self.tick, encounter, own, others, 0.5, True, False))

    def publish_scene(self) -> None:
        places, headings = self.places.tolist(), self.headings.tolist()
        robots = [
            SceneRobot(robot, COLONY, x_m, y_m, heading, False, 0.0, 1.0, 0.0, False)
            for robot, (x_m, y_m), heading in zip(self.ids, places, headings, strict=True)
        ]
        packs = [ScenePack(x, y, 0.0, 0.0, 1.0, 0.4) for x, y in self.packs[:2000].tolist()]
        scene = Scene(
            ARENA, 1, self.tick, self.tick, int(1000 * time.time()), 1.0 / HZ,
            self.side_m, self.side_m, robots[:1000], packs,
        )  # fmt: skip
        self.put(self.arena.scene, encode(scene))

    def publish_state(self, number: int) -> None:
        robot = self.ids[number]
        state = RobotState(
            robot=robot, number=number, arena=ARENA, incarnation=0, seq=self.seqs[number],
            unix_ms=int(1000 * time.time()), tick=self.tick, generation=0,
            agent=f"{robot.hex()}/{self.tick % AGENTS}", energy=float(self.energies[number]),
            module=(number + self.tick // 30) % 2, matings=self.matings[number],
            conceptions=0, captures=0, pool=0, waiting=0, doubts=0, orphaned=0,
            peers=self.count - 1, refused=0, dropped=0, faults=0, period_ms=1000.0 / HZ,
        )  # fmt: skip
        self.put(self.keys.state(robot), encode(state))


def live(connection: Connection, count: int, endpoint: str, walks: bool = True) -> None:
    """Run a synthetic colony until killed; one that does not walk stands still, and jumps on command."""
    with open_session(NetworkSettings(listen=(endpoint,))) as session:
        colony = SyntheticColony(session, count)
        connection.send("ready")
        colony.publish_births()
        next_s = time.monotonic()
        while True:
            next_s += 1.0 / HZ
            if connection.poll(max(0.0, next_s - time.monotonic())):
                if connection.recv() == SENT:
                    connection.send(colony.sent)
                    continue
                colony.places[0] = -colony.places[0]
                at_s = time.monotonic()
                colony.publish_scene()
                connection.send(at_s)
            elif walks:
                colony.step()
            else:
                colony.tick += 1
                colony.publish_scene()
                colony.publish_state(colony.tick % count)
