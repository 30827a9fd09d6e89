"""The arena as robots meet it: they join, act, are observed, and leave. No I/O, no clock, no threads, no selection.

A process carries its messages (`messages.py`, "Between a robot and its body"). Robots that live in that same process
join like all others, and then `command` their bodies and read `arena` directly.

A tick is one control period. Whoever was observed in it may answer, and in lockstep the arena waits for the answer of
everybody who is there. A robot that joins has observed nothing yet: it is waited for from the next tick on. Whose
process is gone from the network is not waited for; its body stays for a while, and its time to live stops it.
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
    """An arena with `config.robots` places; `world` names this run of it.

    In lockstep the first tick waits for `expect` robots, and every other for all that are there. `find`, `lose` and
    `remove_absent` are told by whoever watches the network. Raises ValueError as `Arena` does, and if more robots are
    expected than there are places.
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
            raise ValueError(f"robots: {expect} are expected, but the arena has {slots} places")
        self.arena_run = arena_run
        self.lockstep = lockstep
        self.expect = expect
        self.tick = 0
        self.arena = Arena(slots, config.arena, config.body, config.seed, embodied=False)
        self.robots: dict[RobotId, int] = {}
        """Who has a body, and in which place"""
        self.colonies: list[str] = []
        """Their names; a body knows its colony by its number"""
        self.counts: Counter[str] = Counter()
        """What was refused, by reason: full, unknown, malformed, stale, too many"""
        self._period_s = config.arena.control_period_s
        self._grace_s = body_grace_s
        self._body = msgspec.json.encode(config.body).decode()
        self._settings = settings_as_json(
            {"arena": config.arena, "body": config.body}, MAX_ARENA_SETTINGS
        )
        self._occupants: list[RobotId | None] = [None] * slots
        self._lost: dict[RobotId, float] = {}
        self._actions = np.zeros((slots, contract.ACTION_WIDTH))
        self._fresh = np.zeros(slots, dtype=np.bool_)
        self._answered = np.zeros(slots, dtype=np.int64)
        """The tick whose observation a robot answered last"""

    # Who is there ---------------------------------------------------------------------------------------------------

    def join(self, request: Join) -> BodyGranted | BodyDenied:
        """Give a robot a body, in the place it would like if that is free; it keeps the one that it has.

        A robot that comes back under another colony gets a fresh one. It may answer observations from the next tick on.
        """
        robot = request.robot
        slot = self.robots.get(robot)
        if slot is not None:
            if self.colony_of(robot) == request.colony:
                self.mark_online(robot)
                return self._embodied(slot)
            self.leave(robot)
        slot = self._free_slot(request.slot)
        if slot is None:
            return self._refused(f"full: all {len(self._occupants)} places are taken")
        try:
            self.arena.embody(slot, self._number_of(request.colony))
        except ValueError as error:
            return self._refused(f"full: {error}")
        self.robots[robot] = slot
        self._occupants[slot] = robot
        self._actions[slot] = 0.0
        self._fresh[slot] = False
        self._answered[slot] = self.tick
        return self._embodied(slot)

    def leave(self, robot: RobotId) -> None:
        """Take a robot's body away; nothing happens if it has none."""
        slot = self.robots.pop(robot, None)
        if slot is not None:
            self._occupants[slot] = None
            self._fresh[slot] = False
            self._lost.pop(robot, None)
            self.arena.remove(slot)

    def mark_offline(self, robot: RobotId, now_s: float) -> None:
        """A robot's process is gone from the network: nobody waits for it, and its body stays for a while."""
        if robot in self.robots:
            self._lost.setdefault(robot, now_s)

    def mark_online(self, robot: RobotId) -> None:
        """It is back, and waited for again; what it missed is to be sent again."""
        self._lost.pop(robot, None)

    def remove_absent(self, now_s: float) -> list[RobotId]:
        """Take the bodies away of all who have been lost for too long; return who they were."""
        gone = [robot for robot, at_s in self._lost.items() if now_s - at_s >= self._grace_s]
        for robot in gone:
            self.leave(robot)
        return gone

    def slot_of(self, robot: RobotId) -> int:
        """Return a robot's place in the arena; raises KeyError if it has none."""
        return self.robots[robot]

    def occupant(self, slot: int) -> RobotId | None:
        """Return whose body is in a place, or None."""
        return self._occupants[slot]

    def colony_of(self, robot: RobotId) -> str:
        """Return the name of a robot's colony; raises KeyError if it has no body."""
        return self.colonies[int(self.arena.world.colonies[self.robots[robot]])]

    def _free_slot(self, wanted: int) -> int | None:
        free = [slot for slot, robot in enumerate(self._occupants) if robot is None]
        return wanted if wanted in free else next(iter(free), None)

    def _number_of(self, colony: str) -> int:
        """Return a colony's number. There are never more of them than places: extinct ones are forgotten then."""
        if colony in self.colonies:
            return self.colonies.index(colony)
        if len(self.colonies) < len(self._occupants):
            self.colonies.append(colony)
            return len(self.colonies) - 1
        alive = set(self.arena.world.colonies.tolist())
        number = next(k for k in range(len(self.colonies)) if k not in alive)
        self.colonies[number] = colony
        return number

    def _embodied(self, slot: int) -> BodyGranted:
        return BodyGranted(
            slot, self.arena_run, self.tick, self._period_s, self.lockstep, self._body
        )

    def _refused(self, reason: str) -> BodyDenied:
        self.counts["full"] += 1
        return BodyDenied(reason)

    # From tick to tick ----------------------------------------------------------------------------------------------

    def apply_action(self, robot: RobotId, action: Action) -> bool:
        """Command a robot's body within its limits; return whether it will obey, and count why not.

        An action answers an observation: only one that its robot had, newer than the last one answered, and in
        lockstep the present one. In real time it must not have outlived its own time to live on the way; one that is
        to stop everything (it has none) is never too late.
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
        self._take(slot, row, action.tick)
        return True

    def set_action(self, slot: int, action: FloatArray) -> None:
        """Command the body of a robot of this process, whose action is known to be within limits."""
        self._take(slot, action, self.tick)

    def _take(self, slot: int, action: FloatArray, tick: int) -> None:
        self._actions[slot] = action
        self._fresh[slot] = True
        self._answered[slot] = tick

    def _refuse(self, reason: str) -> bool:
        self.counts[reason] += 1
        return False

    @property
    def waiting_for(self) -> list[RobotId]:
        """Who is there and has not answered the present observation yet."""
        return list(self._awaited())

    def _awaited(self) -> Iterator[RobotId]:
        for robot, slot in self.robots.items():
            if self._answered[slot] < self.tick and robot not in self._lost:
                yield robot

    @property
    def is_ready(self) -> bool:
        """Whether the next tick may come: always in real time, and in lockstep when nobody is waited for.

        In lockstep time stands still where nobody is there.
        """
        if not self.lockstep:
            return True
        is_begun = self.tick > 0 or len(self.robots) >= self.expect
        return is_begun and len(self.robots) > len(self._lost) and not any(self._awaited())

    def step(self) -> None:
        """Let one control period pass; then everybody with a body is observed."""
        step_world(self.arena.world, self._actions, self._fresh)
        self._fresh[:] = False
        self.tick += 1

    def observation(self, robot: RobotId) -> bytes:
        """Return what a robot's body senses in this tick, as a message; raises KeyError if it has no body."""
        row: FloatArray = self.arena.world.observations[-1, self.robots[robot]]
        contact = None
        if row[contract.ENCOUNTER] > 0.0:
            partner = self._occupants[int(row[contract.ENCOUNTER_ROBOT])]
            if partner is not None:
                contact = Contact(partner, int(row[contract.ENCOUNTER_NONCE]))
        return encode(Observation(self.arena_run, self.tick, pack_row(row), contact))

    def metadata(self, arena: str) -> ArenaMetadata:
        """Return what an observer is told that asks what the arena is like."""
        return ArenaMetadata(arena, self.arena_run, self._settings)

    def scene(self, arena: str, seq: int, unix_ms: int) -> Scene:
        """Return what a spectator sees: of a crowd, as many as a message holds."""
        bodies = (
            SceneBody(robot, self.colony_of(robot), slot) for robot, slot in self.robots.items()
        )
        return make_scene(self.arena.world, bodies, arena, self.arena_run, seq, self.tick, unix_ms)

    def save(self) -> dict[str, Any]:
        """Return all there is of the arena; `restore` makes one of the same config go on identically."""
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
        """Become a saved arena of the same config, with nobody lost; raises ValueError if it does not fit."""
        self.arena.restore(saved["arena"])
        self.tick = saved["tick"]
        self.robots = {bytes.fromhex(robot): slot for robot, slot in saved["robots"].items()}
        self.colonies = list(saved["colonies"])
        self._occupants = [None] * len(self._occupants)
        for robot, slot in self.robots.items():
            self._occupants[slot] = robot
        self._lost.clear()
        self._actions[...] = saved["actions"]
        self._fresh[...] = saved["fresh"]
        self._answered[...] = saved["answered"]
