"""One process that carries an arena and many robots: each a full citizen, with its own id, key, memory and letters.

Bodies and minds of the robots here are stepped together in compiled code; robots of other processes may have bodies
in the same arena. All of them mate by the same letters.
"""

import contextlib
import secrets
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rich.console import Console

from crcolony.body import contract
from crcolony.config import Config
from crcolony.nodes.arena_node import ArenaNode
from crcolony.nodes.embodied_robot import STATE_PERIOD_S
from crcolony.nodes.reported_settings import settings_of_robot
from crcolony.nodes.robot_node import RobotNode
from crcolony.protocol.body_messages import Contact, Join
from crcolony.protocol.identity import RobotId, create_key, load_key
from crcolony.results.run_folder import keep_config
from crcolony.results.run_report import print_run_report
from crcolony.robot.factory import make_robots, own_streams
from crcolony.robot.state import Robots, StepParameters
from crcolony.robot.step import step_robots
from crcolony.runtime.arena_process import ArenaProcess, restore_arena
from crcolony.runtime.console import print_line
from crcolony.runtime.start_arena import new_arena
from crcolony.shutdown import ShutdownSignal
from crcolony.storage.files import ARENA_CHECKPOINT, KEY_FILE, ROBOT_FILE, make_folder
from crcolony.storage.store import RobotStore
from crcolony.transport.inbox import Inbox
from crcolony.transport.interface import (
    EnvelopeReceived,
    InboundEvent,
    QueryReceived,
    RobotOffline,
    RobotOnline,
)
from crcolony.transport.zenoh_arena import ArenaTransport
from crcolony.transport.zenoh_robots import RobotTransport
from crcolony.transport.zenoh_session import NetworkSettings, open_session

_SNAPSHOT_S, _SNAPSHOT_ROBOT_S = 10.0, 0.5
"""A robot is saved this often, but not more often than so many seconds for each robot of the process."""
_PLAIN_LINES_S = 5.0


class HostProcess(ArenaProcess):
    """An arena process in which robots live, too."""

    def __init__(
        self,
        node: ArenaNode,
        name: str,
        transport: ArenaTransport,
        robots: list[RobotNode],
        batch: Robots,
        parameters: StepParameters,
        envelopes: RobotTransport,
        inbox: Inbox,
        wall_period_s: float | None,
        checkpoint: Path,
        print_line: Callable[[str], None],
    ) -> None:
        super().__init__(node, name, transport, inbox, wall_period_s, checkpoint, print_line)
        self._robots = robots
        self._here = {robot.id: robot for robot in robots}
        self._batch, self._parameters, self._robot_transport = batch, parameters, envelopes
        self._actions = np.zeros((len(robots), contract.ACTION_WIDTH))
        self._snapshot_s = max(_SNAPSHOT_S, _SNAPSHOT_ROBOT_S * len(robots))
        now_s = time.monotonic()
        self._state_due_s = self._line_due_s = now_s
        self._snapshot_due_s = now_s + self._snapshot_s / len(robots)
        self._saved_last = 0

    def start(self, colony: str, settings: str) -> None:
        """Bring all robots to life and give them bodies; raises Refusal for a memory that does not fit.

        `settings` are what every robot tells of its own.
        """
        now_s = time.monotonic()
        for slot, robot in enumerate(self._robots):
            robot.start(now_s)
            self._node.join(Join(robot.id, colony, slot))
            robot.arena, robot.settings = self._name, settings
            self._robot_transport.add_robot(robot.id, robot.incarnation)

    def stop(self) -> None:
        """Save all robots, and let them be gone from the network."""
        for robot in self._robots:
            robot.save()
            self._robot_transport.remove_robot(robot.id)

    def _run_in_lockstep(self, is_stopped: Callable[[], bool]) -> None:
        """As fast as possible: nobody is waited for, robots of other processes least of all."""
        while not is_stopped():
            self._advance()
            while (event := self._inbox.get(0.0)) is not None:
                self._take(event)
            self._keep_house(time.monotonic())

    def _advance(self) -> None:
        """Let one control period pass for the world, and for the minds of the robots here."""
        node = self._node
        for slot, action in enumerate(self._actions):
            node.set_action(slot, action)
        node.step()
        observations = node.arena.world.observations[-1]
        here = observations[: len(self._robots)]
        if step_robots(self._batch, self._parameters, here, self._actions):
            self._attend(here)
        self._observe(robot for robot in node.robots if robot not in self._here)

    def _attend(self, observations: np.ndarray) -> None:
        now_s, tick = time.monotonic(), self._node.tick
        for row in np.flatnonzero(self._batch.events).tolist():
            robot = self._robots[row]
            robot.handle_step_events(now_s, tick, self._contact(observations[row]))
            robot.advance_slice()

    def _contact(self, observation: np.ndarray) -> Contact | None:
        if observation[contract.ENCOUNTER] == 0.0:
            return None
        partner = self._node.occupant(int(observation[contract.ENCOUNTER_ROBOT]))
        return Contact(partner, int(observation[contract.ENCOUNTER_NONCE])) if partner else None

    def _take(self, event: InboundEvent) -> None:
        now_s = time.monotonic()
        match event:
            case EnvelopeReceived(to=to, envelope=envelope) if to in self._here:
                self._here[to].handle_envelope(now_s, envelope)
            case RobotOnline(robot=peer, incarnation=incarnation, session=session):
                super()._take(event)
                for robot in self._robots:
                    robot.handle_peer_online(now_s, peer, incarnation, session)
            case RobotOffline(robot=peer, incarnation=incarnation, session=session):
                if peer not in self._here:
                    super()._take(event)
                for robot in self._robots:
                    robot.handle_peer_offline(now_s, peer, incarnation, session)
            case QueryReceived(topic="history", robot=asked, payload=payload, reply=reply):
                self._here[asked].reply_history(payload, reply)
            case QueryReceived(topic="metadata", robot=asked, payload=payload, reply=reply) if (
                asked
            ):
                self._here[asked].reply_metadata(payload, reply)
            case _:
                super()._take(event)

    def _keep_house(self, now_s: float) -> None:
        super()._keep_house(now_s)
        for robot in self._robots:
            if robot.next_s <= now_s:
                robot.handle_timeouts(now_s)
        if now_s >= self._state_due_s:
            self._state_due_s = now_s + STATE_PERIOD_S
            for robot in self._robots:
                robot.publish_state(self._inbox.dropped)
        if now_s >= self._snapshot_due_s:
            self._snapshot_due_s = now_s + self._snapshot_s / len(self._robots)
            self._saved_last = (self._saved_last + 1) % len(self._robots)
            self._robots[self._saved_last].save()
        if now_s >= self._line_due_s:
            self._line_due_s = now_s + _PLAIN_LINES_S
            self._print_line(self._in_words())

    def _in_words(self) -> str:
        robots = self._robots
        elsewhere = len(self._node.robots) - len(robots)
        return (
            f"tick {self._node.tick}: {len(robots)} robots here, {elsewhere} from elsewhere,"
            f" generation {min(robot.robot.generation for robot in robots)},"
            f" matings {sum(robot.matings for robot in robots) / 2:g},"
            f" offspring {sum(robot.conceptions for robot in robots)}"
        )


def run_host(
    config: Config,
    count: int,
    folder: Path,
    colony: str,
    arena: str,
    network: NetworkSettings,
    wall_period_s: float | None,
    minutes: float | None,
) -> None:
    """Run an arena with robots in this process until told to stop; raises Refusal, or Broken when a disk fails."""
    make_folder(folder)
    keep_config(folder, config)
    inbox = Inbox()
    arena_run = secrets.randbelow(2**62)
    node = new_arena(config, arena_run, lockstep=False, expect=0)
    folders = [folder / "robots" / str(number) for number in range(count)]
    identities = []
    for own in folders:
        make_folder(own)
        key = own / KEY_FILE
        identities.append(load_key(key) if key.exists() else create_key(key))
    ids: list[RobotId] = [identity.id for identity in identities]
    batch, parameters, robots = make_robots(
        config, [robot.hex() for robot in ids], own_streams(ids)
    )
    restore_arena(node, folder / ARENA_CHECKPOINT)
    step_robots(  # compiles before anybody waits
        *make_robots(config, ["0"], own_streams(ids[:1]))[:2],
        np.zeros((1, contract.OBSERVATION_WIDTH)),
        np.zeros((1, contract.ACTION_WIDTH)),
    )
    stop = ShutdownSignal(minutes, wake=inbox.wake)
    with contextlib.ExitStack() as opened:
        session = opened.enter_context(open_session(network))
        envelopes = RobotTransport(session, colony, arena, inbox.deliver)
        nodes = []
        for number, (identity, robot, own) in enumerate(
            zip(identities, robots, folders, strict=True)
        ):
            schema = bytes.fromhex(robot.subpopulation.schema.digest)
            store = RobotStore(own / ROBOT_FILE, identity.id, schema)
            opened.callback(store.close)
            incarnation = store.begin_incarnation(int(time.time()))
            nodes.append(
                RobotNode(identity, colony, number, robot, batch, store, incarnation, envelopes)
            )
        transport = ArenaTransport(session, arena, arena_run, inbox.deliver)
        process = HostProcess(
            node, arena, transport, nodes, batch, parameters, envelopes, inbox, wall_period_s,
            folder / ARENA_CHECKPOINT, print_line,
        )  # fmt: skip
        process.start(colony, settings_of_robot(config, config.body))
        slots = config.robots - count
        print_line(
            f"{count} robots of colony {colony} in arena {arena}, and {slots} places for others"
        )
        try:
            process.run(stop)
        finally:
            process.stop()
    print_run_report(Console(), folder, config)
