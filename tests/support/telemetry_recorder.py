"""Records what a colony publishes, to compare the picture of a dashboard with it."""

import math
import time
from bisect import bisect_left, bisect_right

import zenoh
from zenoh.handlers import Callback

from crcolony.protocol import key_expressions
from crcolony.protocol.key_expressions import ColonyKeys
from crcolony.protocol.signed_telemetry import open_telemetry
from crcolony.protocol.telemetry_messages import (
    Exchanged,
    RobotState,
    Scene,
    SceneRobot,
    decode_event,
    decode_scene,
    decode_state,
)

BODY_M = 0.11
"""Radius of a robot as it is drawn."""
PACK_M = 0.04
"""Radius of a battery pack as it is drawn."""


class TelemetryRecorder:
    """Keeps scenes, states and matings with the wall time (s) at which they arrived."""

    def __init__(self, session: zenoh.Session) -> None:
        self.scenes: list[tuple[float, Scene]] = []
        self.states: list[tuple[float, RobotState]] = []
        self.matings: list[tuple[float, Exchanged]] = []
        keys = ColonyKeys("*")
        self._entities = [
            session.declare_subscriber(key, Callback(on_sample, indirect=False))
            for key, on_sample in (
                (key_expressions.ALL_SCENES, self._on_scene),
                (keys.all_states, self._on_state),
                (keys.all_events, self._on_event),
            )
        ]

    def _on_scene(self, sample: zenoh.Sample) -> None:
        self.scenes.append(
            (time.time(), decode_scene(open_telemetry(sample.payload.to_bytes()).content))
        )

    def _on_state(self, sample: zenoh.Sample) -> None:
        self.states.append(
            (time.time(), decode_state(open_telemetry(sample.payload.to_bytes()).content))
        )

    def _on_event(self, sample: zenoh.Sample) -> None:
        message = decode_event(open_telemetry(sample.payload.to_bytes()).content)
        if isinstance(message.event, Exchanged):
            self.matings.append((time.time(), message.event))

    def scenes_within(self, from_s: float, to_s: float) -> list[Scene]:
        """Return the scenes that arrived between two times."""
        times = [at_s for at_s, _ in self.scenes]
        return [s for _, s in self.scenes[bisect_left(times, from_s) : bisect_right(times, to_s)]]

    def energies(self, robot: bytes, from_s: float, to_s: float) -> list[float]:
        """Return the energies of a robot in the states that arrived between two times."""
        return [
            state.energy
            for at_s, state in self.states
            if state.robot == robot and from_s <= at_s <= to_s
        ]


def room_m(scene: Scene, robot: SceneRobot) -> float:
    """Return the distance from the centre of a robot to the edge of the nearest other robot or pack."""
    others = [(o.x_m, o.y_m, BODY_M) for o in scene.robots if o.robot != robot.robot]
    others += [(pack.x_m, pack.y_m, PACK_M) for pack in scene.packs]
    return min(math.hypot(x - robot.x_m, y - robot.y_m) - radius for x, y, radius in others)
