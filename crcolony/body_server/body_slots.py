"""Which robot has which body, and which of its actions are applied. No I/O, no clock, no threads.

Arenas and bridges have the same rules: a body is a slot. A tick is one control period. Each robot with an observation
may answer it with one action. The body of a robot that is offline stays for a while; the time to live of its last
action stops it.
"""

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Iterator

import numpy as np

from crcolony.body import contract
from crcolony.compiled import FloatArray
from crcolony.protocol.body_messages import (
    Action,
    BodyGranted,
    Contact,
    Observation,
    pack_row,
    unpack_row,
)
from crcolony.protocol.codec import WireError, encode
from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import ArenaMetadata


class NoBodyError(Exception):
    """A robot gets no body; the message says why."""


class BodySlots(ABC):
    """The bodies of one process; `arena_run` is the id of this run, `body` the settings of a body as JSON.

    A subclass has the bodies themselves, and says with `_embody` that a slot is taken.
    """

    def __init__(
        self,
        slots: int,
        arena_run: int,
        period_s: float,
        *,
        lockstep: bool = False,
        grace_s: float = 30.0,
    ) -> None:
        self.arena_run = arena_run
        self.lockstep = lockstep
        self.tick = 0
        self.robots: dict[RobotId, int] = {}
        """The slot of every robot that has a body"""
        self.colonies: list[str] = []
        """Names of the colonies, by number"""
        self.counts: Counter[str] = Counter()
        """Refused requests and actions, by reason: full, unknown, malformed, forged, stale, too many"""
        self.slots = slots
        self._period_s, self._grace_s = period_s, grace_s
        self._occupants: list[RobotId | None] = [None] * slots
        self._ids = np.zeros((slots, 2), dtype=np.int64)
        """The ids of the robots, as two words each"""
        self._colony_numbers = np.full(slots, -1, dtype=np.int64)
        self._offline: dict[RobotId, float] = {}
        """Robots with a body that are offline, and since when"""
        self._answered = np.zeros(slots, dtype=np.int64)
        """The tick of the last observation that a slot has answered"""

    # What a subclass has ----------------------------------------------------------------------------------------------

    def _is_usable(self, slot: int) -> bool:
        """Return whether a robot can have this slot, if it is free."""
        return True

    @abstractmethod
    def _embody(self, slot: int, colony: int) -> None:
        """Begin to use the body of a slot for a colony; raises ValueError, with a reason, if that is impossible."""

    @abstractmethod
    def _remove(self, slot: int) -> None:
        """Stop using the body of a slot."""

    @abstractmethod
    def _act(self, slot: int, action: FloatArray) -> None:
        """Apply an action, which is within the limits."""

    @abstractmethod
    def _body_settings(self, slot: int) -> str:
        """Return the settings of the body of a slot, the group `[body]` as JSON."""

    @abstractmethod
    def _sense(self, slot: int) -> tuple[FloatArray, Contact | None]:
        """Return the observation (OBSERVATION_WIDTH,) of a slot in this tick, and its contact."""

    @abstractmethod
    def metadata(self, arena: str) -> ArenaMetadata:
        """Return the reply to an observer's metadata query; `arena` is the name of the arena."""

    # Joining and leaving ----------------------------------------------------------------------------------------------

    def join(self, robot: RobotId, colony: str, wanted_slot: int = -1) -> int:
        """Give a robot a body, in the slot that it wants if that is free, and return the slot.

        A robot that has a body keeps it. It may answer observations from the next tick on. Raises NoBodyError.
        """
        slot = self.robots.get(robot)
        if slot is not None:
            if self.colony_of(robot) != colony:
                raise self._no_body(
                    f"in use: the robot has a body in colony {self.colony_of(robot)}"
                )
            self.mark_online(robot)
            return slot
        slot = self._free_slot(wanted_slot)
        if slot is None:
            raise self._no_body(self._why_no_slot())
        number = self._number_of(colony)
        try:
            self._embody(slot, number)
        except ValueError as error:
            raise self._no_body(f"full: {error}") from None
        self.robots[robot] = slot
        self._occupy(slot, robot)
        self._colony_numbers[slot] = number
        self._answered[slot] = self.tick
        return slot

    def _occupy(self, slot: int, robot: RobotId) -> None:
        self._occupants[slot] = robot
        self._ids[slot] = np.frombuffer(robot, dtype=np.int64)

    def leave(self, robot: RobotId) -> None:
        """Remove a robot's body, if it has one."""
        slot = self.robots.pop(robot, None)
        if slot is not None:
            self._occupants[slot] = None
            self._colony_numbers[slot] = -1
            self._offline.pop(robot, None)
            self._remove(slot)

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
        return self.colonies[int(self._colony_numbers[self.robots[robot]])]

    def _free_slot(self, wanted: int) -> int | None:
        free = [
            slot
            for slot, robot in enumerate(self._occupants)
            if robot is None and self._is_usable(slot)
        ]
        return wanted if wanted in free else next(iter(free), None)

    def _why_no_slot(self) -> str:
        return f"full: all {len(self._occupants)} slots are taken"

    def _number_of(self, colony: str) -> int:
        """Return a colony's number; beyond as many colonies as slots, reuse that of one without bodies."""
        if colony in self.colonies:
            return self.colonies.index(colony)
        if len(self.colonies) < len(self._occupants):
            self.colonies.append(colony)
            return len(self.colonies) - 1
        alive = set(self._colony_numbers.tolist())
        number = next(k for k in range(len(self.colonies)) if k not in alive)
        self.colonies[number] = colony
        return number

    def grant(self, slot: int, request: bytes, exchange_key: bytes) -> BodyGranted:
        """Return the reply that a robot has the body of a slot; the request and the key are those of its link."""
        return BodyGranted(
            request,
            exchange_key,
            slot,
            self.arena_run,
            self.tick,
            self._period_s,
            self.lockstep,
            self._body_settings(slot),
        )

    def _no_body(self, reason: str) -> NoBodyError:
        self.counts["full"] += 1
        return NoBodyError(reason)

    # Actions and observations -----------------------------------------------------------------------------------------

    def apply_action(self, robot: RobotId, action: Action) -> bool:
        """Apply a robot's action, clipped to the limits; return whether it is accepted.

        An action answers an observation that its robot had: newer than the last one answered, and in lockstep the
        present one. In real time it must be younger than its own time to live; an action without one stops the body
        and is never too late. Refused actions are counted by reason.
        """
        try:
            row = unpack_row(action.row)
        except (WireError, ValueError):
            return self._refuse("malformed")
        return self.apply_row(robot, action.tick, row)

    def apply_row(self, robot: RobotId, tick: int, action: FloatArray) -> bool:
        """Apply a robot's action (ACTION_WIDTH,) for the observation of a tick; see `apply_action`."""
        slot = self.robots.get(robot)
        if slot is None:
            return self._refuse("unknown")
        try:
            row = contract.clip_action(action)
        except ValueError:
            return self._refuse("malformed")
        age = self.tick - tick
        is_late = age > 0 if self.lockstep else 0.0 < row[contract.TTL] < age * self._period_s
        if is_late or age < 0 or tick <= self._answered[slot]:
            return self._refuse("stale")
        self._answered[slot] = tick
        self._act(slot, row)
        return True

    @property
    def refusals(self) -> str:
        """What was refused, for people: `refused: 3 forged, 12 stale`."""
        return "refused: " + (
            ", ".join(f"{n} {why}" for why, n in sorted(self.counts.items())) or "none"
        )

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

    def sense(self, robot: RobotId) -> tuple[FloatArray, Contact | None]:
        """Return what a robot's body senses in this tick (OBSERVATION_WIDTH,), and its contact; raises KeyError."""
        return self._sense(self.robots[robot])

    def observation(self, robot: RobotId) -> bytes:
        """Return the encoded observation of a robot's body in this tick; raises KeyError if it has no body."""
        row, contact = self.sense(robot)
        return encode(Observation(self.arena_run, self.tick, pack_row(row), contact))
