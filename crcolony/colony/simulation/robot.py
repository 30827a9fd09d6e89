"""The process of one robot in virtual time, as `processes/robot.py` runs it, which dies between any two effects.

A crash forgets everything but the file of its memory; the next life begins from that, as a real process does.
"""

import math
import traceback
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from random import Random

import msgspec

from crcolony.colony.encounters import (
    Limits,
)
from crcolony.colony.identity import Identity
from crcolony.colony.memory.store import StoreBroken, StoreFull
from crcolony.colony.messages import (
    Action,
    Embodied,
    Join,
    Leave,
    Observation,
    decode_observation,
    decode_place,
    encode,
    pack_row,
    unpack_row,
)
from crcolony.colony.node import RobotNode
from crcolony.colony.raising import numbered_streams, raise_robots
from crcolony.colony.simulation.checks import Witness
from crcolony.colony.simulation.faults import CrashError, Faults, Hazard
from crcolony.colony.simulation.network import Schedule, SimulatedNetwork, SimulatedTransport
from crcolony.colony.simulation.store import Disk, SimulatedStore
from crcolony.colony.transport import (
    ArenaGone,
    ArenaSeen,
    Arrival,
    Mail,
    Observed,
    Placed,
    RobotGone,
    RobotSeen,
    Transport,
)
from crcolony.config import Config
from crcolony.robot.batch import habits_of
from crcolony.world.settings import CyberRodent

COLONY = "simulated"
_BEGINNING_UNIX_S = 1_800_000_000.0
_SNAPSHOT_S, _STATE_S, _SILENCE_S, _JOIN_RETRY_S = 8.0, 2.5, 3.0, 1.0
_INBOX = 64
"""What a process that is stopped finds when it goes on; the network lets the rest go."""


@dataclass(frozen=True)
class Surroundings:
    """What all robots of a simulated colony share."""

    config: Config
    limits: Limits
    faults: Faults
    folder: Path
    schedule: Schedule
    network: SimulatedNetwork
    witness: Witness
    rng: Random


class SimulatedRobot:
    """A robot: one life after the other."""

    def __init__(self, number: int, identity: Identity, around: Surroundings) -> None:
        self.id, self.number, self.around = identity.id, number, around
        self.node: RobotNode | None = None
        self.is_paused = False
        self.clock_error_s = 0.0
        self._identity = identity
        self._memory: SimulatedStore | None = None
        self._hazard = Hazard(around.rng, 0.0)
        self.disk = Disk(around.rng, around.faults.broken_disks)
        self._inbox: deque[Arrival] = deque()
        self._place: Embodied | None = None
        self._observed_s = -math.inf
        self._starts = 0

    # Lives -----------------------------------------------------------------------------------------------------

    def start(self) -> None:
        """Begin a life from the disk, unless one is under way."""
        if self._memory is None:
            self._starts += 1
            self._guard(self._begin)

    def _begin(self) -> None:
        around = self.around
        is_calm = around.network.is_calm
        self._hazard = Hazard(around.rng, 0.0 if is_calm else around.faults.crash_operations)
        self._transport = SimulatedTransport(
            around.network, self.id, self._hazard.strike, around.witness.overhear
        )
        node = self.new_node(self._transport)
        node.begin(around.schedule.now_s)
        around.witness.began(node)
        self._place = None
        self._tick = -1
        self._inbox.clear()
        now_s = around.schedule.now_s
        self._observed_s, self._join_s, self._alarm_s = -math.inf, now_s, math.inf
        self._snapshot_s, self._state_s = now_s + _SNAPSHOT_S, now_s
        self.node = node
        session = f"{self.number}.{self._starts}"
        seen = RobotSeen(self.id, node.life, session)
        around.network.host(self.id, self, seen, RobotGone(self.id, node.life, session))

    def new_node(self, transport: Transport) -> RobotNode:
        """Return the robot as its memory has it, in a new life that has not begun."""
        around, config = self.around, self.around.config
        streams = numbered_streams(config.seed, self.number, 1)
        batch, _, (robot,) = raise_robots(config, [self.id.hex()], streams)
        schema = bytes.fromhex(robot.subpopulation.schema.digest)
        self._memory = memory = SimulatedStore(
            around.folder / str(self.number), self.id, schema, durable=False
        )
        memory.attach(self.id, self.disk, self._hazard, around.witness)
        life = memory.begin_life(int(self.unix_s()))
        return RobotNode(
            self._identity,
            COLONY,
            self.number,
            robot,
            batch,
            memory,
            life,
            transport,
            limits=around.limits,
            unix_s=self.unix_s,
        )

    def crash(self, says_goodbye: bool = True) -> None:
        """Die at once."""
        if self._memory is None:
            return
        around = self.around
        around.network.unhost(self.id, says_goodbye)
        self._memory.drop()
        if self.node is not None:
            around.witness.ended(self.node)
        self.node, self._memory, self.is_paused = None, None, False
        if not around.network.is_calm:
            is_long = around.rng.random() < 0.2
            away_s = around.rng.uniform(3.0, 9.0) if is_long else around.rng.uniform(0.1, 2.0)
            around.schedule.after(away_s, self.start)

    def stop(self) -> None:
        """End as a process does that is asked to."""
        self._guard(self._save_and_leave)

    def _save_and_leave(self) -> None:
        if self.node is None or self.is_paused:
            return
        self.around.network.unhost(self.id, says_goodbye=True)
        self._transport.join(self.id, encode(Leave(self.id)))
        self.node.save()
        self.crash()

    def resume(self) -> None:
        """Go on after a pause, with what has arrived meanwhile."""
        self.is_paused = False
        self._alarm_s = math.inf
        while self._inbox and self.node is not None:
            arrival = self._inbox.popleft()
            self._guard(partial(self._take, arrival))
        if self.node is not None:
            self._guard(self._keep_time)

    def be_spared(self) -> None:
        """Nothing goes wrong any more."""
        self._hazard.lift()
        self.disk.clear()
        self.resume()
        self.start()

    @property
    def is_living(self) -> bool:
        """Whether it is there, has a body, and senses something."""
        silent_s = self.around.schedule.now_s - self._observed_s
        return self.node is not None and self._place is not None and silent_s < 1.0

    def unix_s(self) -> float:
        """Return what the clock of this machine says."""
        return _BEGINNING_UNIX_S + self.around.schedule.now_s + self.clock_error_s

    def _guard(self, do: Callable[[], None]) -> None:
        """Do something as a process that ends where it is struck down, or where it does not know what to do."""
        try:
            do()
        except (CrashError, StoreBroken):
            self.around.witness.counts["crashes"] += 1
            self.crash(self.around.rng.random() < 0.7)
        except StoreFull:  # a life cannot begin
            self.around.witness.counts["no room to begin"] += 1
            self.crash()
        except Exception as error:
            frame = traceback.extract_tb(error.__traceback__)[-1]
            where = f"{Path(frame.filename).name}:{frame.lineno}"
            self.around.witness.complain(f"{type(error).__name__} at {where}: {error}")
            self.crash()
        else:
            self._set_alarm()

    # What arrives ----------------------------------------------------------------------------------------------

    def deliver(self, arrival: Arrival) -> None:
        """Take what has arrived, now or after the pause."""
        if not self.is_paused:
            self._guard(partial(self._take, arrival))
        elif len(self._inbox) < _INBOX:
            self._inbox.append(arrival)

    def _take(self, arrival: Arrival) -> None:
        node, now_s = self.node, self.around.schedule.now_s
        if node is None:
            return
        match arrival:
            case Observed(observation=data):
                self._observe(node, now_s, decode_observation(data))
            case Mail(letter=letter):
                node.receive(now_s, letter)
            case RobotSeen(robot=robot, life=life, session=session):
                node.robot_seen(now_s, robot, life, session)
            case RobotGone(robot=robot, life=life, session=session):
                node.robot_gone(now_s, robot, life, session)
            case Placed(answer=answer):
                self._embody(node, now_s, answer)
            case ArenaSeen():
                self._seek(now_s)
            case ArenaGone(world=world) if self._place and world == self._place.world:
                self._place, node.arena = None, ""

    def _seek(self, now_s: float) -> None:
        self._join_s = now_s + _JOIN_RETRY_S
        self._transport.join(self.id, encode(Join(self.id, COLONY, self.number)))

    def _embody(self, node: RobotNode, now_s: float, answer: bytes) -> None:
        place = decode_place(answer)
        if not isinstance(place, Embodied):
            return
        if self._place is None or place.world != self._place.world:
            self._tick = -1
        self._place, self._observed_s, node.arena = place, now_s, "arena"
        body = msgspec.json.decode(place.body, type=CyberRodent)
        config = self.around.config
        node.robot.embody(habits_of(config.learning, config.life, body))

    def _observe(self, node: RobotNode, now_s: float, observation: Observation) -> None:
        place = self._place
        if place is None or observation.world != place.world or observation.tick <= self._tick:
            return
        node.period_ms = min(1e9, 1000.0 * (now_s - self._observed_s))
        self._observed_s, self._tick = now_s, observation.tick
        action = node.robot.step(unpack_row(observation.row))
        answer = encode(Action(observation.tick, pack_row(action)))
        if observation.contact is not None:
            self.around.witness.met(self.id, observation.contact)
        node.attend(now_s, observation.tick, observation.contact)
        if node.robot.events:
            node.finish_step()
        self._transport.act(self.id, answer)

    # The clock -------------------------------------------------------------------------------------------------

    def _set_alarm(self) -> None:
        if self.node is None:
            return
        seek_s = max(self._join_s, self._observed_s + _SILENCE_S)
        due_s = min(self.node.next_s, self._snapshot_s, self._state_s, seek_s)
        if due_s < self._alarm_s:
            self._alarm_s, starts = due_s, self._starts
            self.around.schedule.at(due_s, lambda: self._ring(starts))

    def _ring(self, starts: int) -> None:
        if self.node is not None and starts == self._starts and not self.is_paused:
            self._alarm_s = math.inf
            self._guard(self._keep_time)

    def _keep_time(self) -> None:
        node, now_s = self.node, self.around.schedule.now_s
        if node is None:
            return
        if now_s >= node.next_s:
            node.let_time_pass(now_s)
        if now_s >= self._state_s:
            self._state_s = now_s + _STATE_S
            self._transport.tell(self.id, "state", encode(node.state(0)))
            self.around.witness.inspect(node)
        if now_s >= self._join_s and now_s >= self._observed_s + _SILENCE_S:
            self._seek(now_s)
        if now_s >= self._snapshot_s:
            self._snapshot_s = now_s + _SNAPSHOT_S
            node.save()
