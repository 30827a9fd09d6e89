"""An arena as a peer of robots: they join, receive observations, send actions, and leave. It makes no selection.

No I/O, no clock, no threads: a process carries its messages. Robots of that same process join like all others, and then
set the actions of their bodies and read `arena` directly.

A tick is one control period. Each robot with an observation may answer it with one action, and in lockstep the arena
waits for the actions of all that are online. It waits for a new robot from the next tick on. The body of a robot that
is offline stays for a while; the time to live of its last action stops it.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any

import msgspec
import numpy as np

from crcolony.body import contract
from crcolony.compiled import FloatArray
from crcolony.config import Config
from crcolony.nodes.reported_settings import settings_as_json
from crcolony.nodes.scene import SceneBody, make_scene
from crcolony.protocol.body_messages import (
    Action,
    BodyDenied,
    BodyGranted,
    Contact,
    Join,
    Observation,
    pack_row,
    unpack_row,
)
from crcolony.protocol.codec import WireError, encode
from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import MAX_ARENA_SETTINGS, ArenaMetadata, Scene
from crcolony.world.arena import Arena
from crcolony.world.tick import step_world


class ArenaNode:
    """An arena with `config.robots` slots for bodies; `arena_run` is the id of this run.

    In lockstep the first tick waits for `expect` robots, and every later one for all that are online. Raises ValueError
    as `Arena` does, and if more robots are expected than there are slots.
    """

    def __init__(
        self,
        config: Config,
        arena_run: int,
        lockstep: bool,
        expect: int = 0,
        *,
        body_grace_s: float = 30.0,
    ) -> None:
        slots = config.robots
        if expect > slots:
            raise ValueError(f"robots: {expect} are expected, but the arena has {slots} slots")
        self.arena_run = arena_run
        self.lockstep = lockstep
        self.expect = expect
        self.tick = 0
        self.arena = Arena(slots, config.arena, config.body, config.seed, embodied=False)
        self.robots: dict[RobotId, int] = {}
        """The slot of every robot that has a body"""
        self.colonies: list[str] = []
        """Names of the colonies, by number"""
        self.counts: Counter[str] = Counter()
        """Refused requests and actions, by reason: full, unknown, malformed, stale, too many"""
        self._period_s = config.arena.control_period_s
        self._grace_s = body_grace_s
        self._body = msgspec.json.encode(config.body).decode()
        self._settings = settings_as_json(
            {"arena": config.arena, "body": config.body}, MAX_ARENA_SETTINGS
        )
        self._occupants: list[RobotId | None] = [None] * slots
        self._offline: dict[RobotId, float] = {}
        """Robots with a body that are offline, and since when"""
        self._actions = np.zeros((slots, contract.ACTION_WIDTH))
        self._fresh = np.zeros(slots, dtype=np.bool_)
        """Whether the action of a slot has arrived since the last tick"""
        self._answered = np.zeros(slots, dtype=np.int64)
        """The tick of the last observation that a slot has answered"""

    # Bodies ---------------------------------------------------------------------------------------------------------

    def join(self, request: Join) -> BodyGranted | BodyDenied:
        """Grant a robot a body, in the requested slot if that is free; a robot that has a body keeps it.

        A robot that joins again with another colony gets a new body. It may answer observations from the next tick on.
        """
        robot = request.robot
        slot = self.robots.get(robot)
        if slot is not None:
            if self.colony_of(robot) == request.colony:
                self.mark_online(robot)
                return self._grant(slot)
            self.leave(robot)
        slot = self._free_slot(request.slot)
        if slot is None:
            return self._deny(f"full: all {len(self._occupants)} slots are taken")
        try:
            self.arena.embody(slot, self._number_of(request.colony))
        except ValueError as error:
            return self._deny(f"full: {error}")
        self.robots[robot] = slot
        self._occupants[slot] = robot
        self._actions[slot] = 0.0
        self._fresh[slot] = False
        self._answered[slot] = self.tick
        return self._grant(slot)

    def leave(self, robot: RobotId) -> None:
        """Remove a robot's body, if it has one."""
        slot = self.robots.pop(robot, None)
        if slot is not None:
            self._occupants[slot] = None
            self._fresh[slot] = False
            self._offline.pop(robot, None)
            self.arena.remove(slot)

    def mark_offline(self, robot: RobotId, now_s: float) -> None:
        """Stop waiting for a robot; its body stays until `remove_absent` removes it."""
        if robot in self.robots:
            self._offline.setdefault(robot, now_s)

    def mark_online(self, robot: RobotId) -> None:
        """Wait for a robot again; the present observation is to be sent to it again."""
        self._offline.pop(robot, None)

    def remove_absent(self, now_s: float) -> list[RobotId]:
        """Remove the bodies of robots that have been offline for too long; return their ids."""
        gone = [robot for robot, at_s in self._offline.items() if now_s - at_s >= self._grace_s]
        for robot in gone:
            self.leave(robot)
        return gone

    def occupant(self, slot: int) -> RobotId | None:
        """Return the robot whose body is in a slot, or None."""
        return self._occupants[slot]

    def colony_of(self, robot: RobotId) -> str:
        """Return the name of a robot's colony; raises KeyError if it has no body."""
        return self.colonies[int(self.arena.world.colonies[self.robots[robot]])]

    def _free_slot(self, wanted: int) -> int | None:
        free = [slot for slot, robot in enumerate(self._occupants) if robot is None]
        return wanted if wanted in free else next(iter(free), None)

    def _number_of(self, colony: str) -> int:
        """Return a colony's number; beyond as many colonies as slots, reuse that of one without bodies."""
        if colony in self.colonies:
            return self.colonies.index(colony)
        if len(self.colonies) < len(self._occupants):
            self.colonies.append(colony)
            return len(self.colonies) - 1
        alive = set(self.arena.world.colonies.tolist())
        number = next(k for k in range(len(self.colonies)) if k not in alive)
        self.colonies[number] = colony
        return number

    def _grant(self, slot: int) -> BodyGranted:
        return BodyGranted(
            slot, self.arena_run, self.tick, self._period_s, self.lockstep, self._body
        )

    def _deny(self, reason: str) -> BodyDenied:
        self.counts["full"] += 1
        return BodyDenied(reason)

    # Ticks --------------------------------------------------------------------------------------------------------

    def apply_action(self, robot: RobotId, action: Action) -> bool:
        """Apply a robot's action, clipped to the limits, in the next tick; return whether it is accepted.

        An action answers an observation that its robot had: newer than the last one answered, and in lockstep the
        present one. In real time it must be younger than its own time to live; an action without one stops the body
        and is never too late. Refused actions are counted by reason.
        """
        slot = self.robots.get(robot)
        if slot is None:
            return self._refuse("unknown")
        try:
            row = contract.clip_action(unpack_row(action.row))
        except (WireError, ValueError):
            return self._refuse("malformed")
        age = self.tick - action.tick
        is_late = age > 0 if self.lockstep else 0.0 < row[contract.TTL] < age * self._period_s
        if is_late or age < 0 or action.tick <= self._answered[slot]:
            return self._refuse("stale")
        self._set_action(slot, row, action.tick)
        return True

    def set_action(self, slot: int, action: FloatArray) -> None:
        """Apply the action of a robot of this process in the next tick; it must be within the limits."""
        self._set_action(slot, action, self.tick)

    def _set_action(self, slot: int, action: FloatArray, tick: int) -> None:
        self._actions[slot] = action
        self._fresh[slot] = True
        self._answered[slot] = tick

    def _refuse(self, reason: str) -> bool:
        self.counts[reason] += 1
        return False

    @property
    def waiting_for(self) -> list[RobotId]:
        """Robots that are online and have not answered the present observation."""
        return list(self._robots_awaited())

    def _robots_awaited(self) -> Iterator[RobotId]:
        for robot, slot in self.robots.items():
            if self._answered[slot] < self.tick and robot not in self._offline:
                yield robot

    @property
    def is_ready(self) -> bool:
        """Whether the next tick may start: always in real time, and in lockstep when all actions have arrived.

        In lockstep no tick starts while no robot is online.
        """
        if not self.lockstep:
            return True
        is_started = self.tick > 0 or len(self.robots) >= self.expect
        return (
            is_started and len(self.robots) > len(self._offline) and not any(self._robots_awaited())
        )

    def step(self) -> None:
        """Simulate one control period; the observations of all bodies are then those of the new tick."""
        step_world(self.arena.world, self._actions, self._fresh)
        self._fresh[:] = False
        self.tick += 1

    def observation(self, robot: RobotId) -> bytes:
        """Return the encoded observation of a robot's body in this tick; raises KeyError if it has no body."""
        row: FloatArray = self.arena.world.observations[-1, self.robots[robot]]
        contact = None
        if row[contract.ENCOUNTER] > 0.0:
            partner = self._occupants[int(row[contract.ENCOUNTER_ROBOT])]
            if partner is not None:
                contact = Contact(partner, int(row[contract.ENCOUNTER_NONCE]))
        return encode(Observation(self.arena_run, self.tick, pack_row(row), contact))

    def metadata(self, arena: str) -> ArenaMetadata:
        """Return the reply to an observer's metadata query; `arena` is the arena's name."""
        return ArenaMetadata(arena, self.arena_run, self._settings)

    def scene(self, arena: str, seq: int, unix_ms: int) -> Scene:
        """Return the scene for observers, with as many bodies as a message holds."""
        bodies = (
            SceneBody(robot, self.colony_of(robot), slot) for robot, slot in self.robots.items()
        )
        return make_scene(self.arena.world, bodies, arena, self.arena_run, seq, self.tick, unix_ms)

    def save(self) -> dict[str, Any]:
        """Return the whole state of the arena; an arena of the same config that restores it continues identically."""
        return {
            "tick": self.tick,
            "arena": self.arena.save(),
            "robots": {robot.hex(): slot for robot, slot in self.robots.items()},
            "colonies": list(self.colonies),
            "actions": self._actions.copy(),
            "fresh": self._fresh.copy(),
            "answered": self._answered.copy(),
        }

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Restore a saved state with all robots online; raises ValueError if it is of another config."""
        self.arena.restore(saved["arena"])
        self.tick = saved["tick"]
        self.robots = {bytes.fromhex(robot): slot for robot, slot in saved["robots"].items()}
        self.colonies = list(saved["colonies"])
        self._occupants = [None] * len(self._occupants)
        for robot, slot in self.robots.items():
            self._occupants[slot] = robot
        self._offline.clear()
        self._actions[...] = saved["actions"]
        self._fresh[...] = saved["fresh"]
        self._answered[...] = saved["answered"]
