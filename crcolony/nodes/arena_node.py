"""An arena as a peer of robots: they join, receive observations, send actions, and leave. It makes no selection.

No I/O, no clock, no threads: a process carries its messages. Robots of that same process join like all others, and then
set the actions of their bodies and read `arena` directly.

In lockstep the arena waits for the actions of all that are online. It waits for a new robot from the next tick on.
"""

from collections import Counter
from collections.abc import Callable, Mapping
from typing import Any

import msgspec
import numpy as np

from crcolony.body import contract
from crcolony.body.shared_pages import (
    MALFORMED,
    STALE,
    Pages,
    take_actions,
    write_observations,
)
from crcolony.body_server.body_slots import BodySlots
from crcolony.compiled import FloatArray, direct
from crcolony.config import Config
from crcolony.nodes.reported_settings import settings_as_json
from crcolony.nodes.scene import SceneBody, make_scene
from crcolony.protocol.body_messages import Contact
from crcolony.protocol.telemetry_messages import MAX_ARENA_SETTINGS, ArenaMetadata, Scene
from crcolony.world.arena import Arena
from crcolony.world.tick import step_world

_LIMITS: FloatArray = np.array(contract.limits(contract.ACTION))
"""The lowest and the highest action"""
_WHEELS = [contract.WHEEL_LEFT, contract.WHEEL_RIGHT]


class ArenaNode(BodySlots):
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
        super().__init__(
            slots,
            arena_run,
            config.arena.control_period_s,
            lockstep=lockstep,
            grace_s=body_grace_s,
        )
        self.expect = expect
        self.arena = Arena(slots, config.arena, config.body, config.seed, embodied=False)
        self._body = msgspec.json.encode(config.body).decode()
        self._settings = settings_as_json(
            {"arena": config.arena, "body": config.body}, MAX_ARENA_SETTINGS
        )
        self._actions = np.zeros((slots, contract.ACTION_WIDTH))
        self._fresh = np.zeros(slots, dtype=np.bool_)
        """Whether the action of a slot has arrived since the last tick"""
        self._direct: dict[Callable[..., None], Callable[..., None]] = {}
        """Compiled functions as they are called without a check of types, by the function"""
        self._counts = np.zeros(3, dtype=np.int64)
        """What became of the last actions from this machine"""
        self.is_held = False
        """Whether an emergency stop holds all bodies: no wheel turns then"""

    # The bodies -----------------------------------------------------------------------------------------------------

    def _embody(self, slot: int, colony: int) -> None:
        self.arena.embody(slot, colony)
        self._actions[slot] = 0.0
        self._fresh[slot] = False

    def _remove(self, slot: int) -> None:
        self._fresh[slot] = False
        self.arena.remove(slot)

    def _act(self, slot: int, action: FloatArray) -> None:
        """Apply an action in the next tick."""
        self._actions[slot] = action
        self._fresh[slot] = True

    def _body_settings(self, slot: int) -> str:
        return self._body

    def _sense(self, slot: int) -> tuple[FloatArray, Contact | None]:
        row: FloatArray = self.arena.world.observations[-1, slot]
        contact = None
        if row[contract.ENCOUNTER] > 0.0:
            partner = self._occupants[int(row[contract.ENCOUNTER_ROBOT])]
            if partner is not None:
                contact = Contact(partner, int(row[contract.ENCOUNTER_NONCE]))
        return row, contact

    # Ticks ----------------------------------------------------------------------------------------------------------

    def set_action(self, slot: int, action: FloatArray) -> None:
        """Apply the action of a robot of this process in the next tick; it must be within the limits."""
        self._act(slot, action)
        self._answered[slot] = self.tick

    def take_actions(self, pages: Pages) -> None:
        """Apply the actions that robots on this machine have written into the memory that they share."""
        counts = self._counts
        counts[:] = 0
        self._call(
            take_actions, pages, self.tick, self.lockstep, self._period_s, _LIMITS,
            self._answered, self._actions, self._fresh, counts,
        )  # fmt: skip
        if counts[STALE] or counts[MALFORMED]:
            self.counts += Counter(stale=int(counts[STALE]), malformed=int(counts[MALFORMED]))

    def write_observations(self, pages: Pages) -> None:
        """Write the observations of this tick into the memory that robots on this machine share."""
        rows = self.arena.world.observations[-1]
        self._call(write_observations, pages, self.tick, rows, self._ids, self._colony_numbers)

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
        if self.is_held:
            self._actions[:, _WHEELS] = 0.0
            self._fresh[:] = True
        self._call(step_world, self.arena.world, self._actions, self._fresh)
        self._fresh[:] = False
        self.tick += 1

    def _call(self, function: Callable[..., None], *arguments: Any) -> None:
        """Call a compiled function whose arguments have the same types in every call."""
        if function not in self._direct:
            self._direct[function] = direct(function, *arguments)
        self._direct[function](*arguments)

    # For observers, and for a checkpoint ----------------------------------------------------------------------------

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
            self._occupy(slot, robot)
        self._colony_numbers[:] = self.arena.world.colonies
        self._offline.clear()
        self._actions[...] = saved["actions"]
        self._fresh[...] = saved["fresh"]
        self._answered[...] = saved["answered"]
