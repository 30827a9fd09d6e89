"""A fake source of telemetry for tests of dashboards: it makes samples and feeds a real monitor and view with them."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

import msgspec
import numpy as np
from crcolony_dashboards.rerun_streams import Moment
from crcolony_dashboards.view_model.colony_view import ColonyView

from crcolony.body.settings import CyberRodent
from crcolony.evolution.history import Born, Lived
from crcolony.nodes.reported_settings import settings_as_json
from crcolony.protocol.codec import Message, encode
from crcolony.protocol.identity import RobotId, seeded
from crcolony.protocol.key_expressions import ArenaKeys, ColonyKeys
from crcolony.protocol.mating_messages import Encounter
from crcolony.protocol.telemetry_messages import (
    MAX_ARENA_SETTINGS,
    MAX_ROBOT_SETTINGS,
    ArenaMetadata,
    EventMessage,
    Exchanged,
    Met,
    RobotEvent,
    RobotMetadata,
    RobotState,
    Scene,
    ScenePack,
    SceneRobot,
)
from crcolony.robot.genes import agent_schema
from crcolony.robot.settings import Heredity, Learning
from crcolony.telemetry.colony_monitor import ColonyMonitor
from crcolony.telemetry.presence import FORGET_S
from crcolony.telemetry.samples import RawSample, SampleKind, parse_sample
from crcolony.world.settings import ArenaSettings
from tests.vectors.make import TELEMETRY

IDS = [seeded("test", 1, number).id for number in range(60)]
T = 1_790_000_000.0
"""Unix seconds"""
SETTINGS = settings_as_json(
    {"body": CyberRodent(), "learning": Learning(), "heredity": Heredity()}, MAX_ROBOT_SETTINGS
)
NATURE = settings_as_json({"arena": ArenaSettings(), "body": CyberRodent()}, MAX_ARENA_SETTINGS)
SCHEMA = agent_schema(Learning(), Heredity())

Where = tuple[int, float, float] | tuple[int, float, float, float]
"""A robot by its number, its position (m) and its heading (rad)."""


def agent(robot: int, number: int) -> str:
    return f"{IDS[robot].hex()}/{number}"


def born(name: str, generation: int = 0, genes: Sequence[float] = (0.5,), **parents: str) -> Born:
    data = np.asarray(genes, dtype="<f8").tobytes()
    mother, father = parents.get("mother"), parents.get("father")
    return Born(0, 0, generation, name, "", data, mother, father)


def lived(name: str, generation: int = 0, **changes: Any) -> Lived:
    incarnation = Lived(100, 0, generation, name, 50, 0.5, 0, 0)
    return msgspec.structs.replace(incarnation, **changes)


def mated(one: int, other: int, count: int = 1, **changes: Any) -> Exchanged:
    """Return one side of a mating that `one` proposed."""
    encounter = Encounter(IDS[one], IDS[other], 3, count)
    event = Exchanged(70, encounter, agent(one, 0), agent(other, 0), 0.5, False, False)
    return msgspec.structs.replace(event, **changes)


def met(other: int) -> Met:
    return Met(70, IDS[other], "robot/0")


class FakeTelemetry:
    """Samples of colonies, handled by a real monitor at the time `at_s` (unix seconds)."""

    def __init__(self, view: ColonyView | None = None) -> None:
        self.view = view or ColonyView(ColonyMonitor())
        self.monitor = self.view.monitor
        self.at_s = T
        self._published = Counter[RobotId]()
        self._scenes = 0

    def handle(self, kind: SampleKind, key: str, message: Message | bytes = b"") -> None:
        payload = message if isinstance(message, bytes) else encode(message)
        raw = RawSample(kind, key, payload, round(1000.0 * self.at_s))
        for change in self.monitor.handle_sample(parse_sample(raw)):
            self.view.handle_change(change, self.at_s)

    def online(self, *robots: int, colony: str = "blue", incarnation: int = 3) -> None:
        for robot in robots:
            self.handle("online", ColonyKeys(colony).alive(IDS[robot], incarnation, "a"))

    def offline(self, *robots: int, colony: str = "blue", incarnation: int = 3) -> None:
        for robot in robots:
            self.handle("offline", ColonyKeys(colony).alive(IDS[robot], incarnation, "a"))

    def state(self, *robots: int, colony: str = "blue", **changes: Any) -> None:
        for robot in robots:
            message: dict[str, Any] = {"robot": IDS[robot], "number": robot, "seq": 0, **changes}
            state = TELEMETRY["state"]
            assert isinstance(state, RobotState)
            key = ColonyKeys(colony).state(IDS[robot])
            self.handle("state", key, msgspec.structs.replace(state, **message))

    def join(self, *robots: int, colony: str = "blue", **changes: Any) -> None:
        """Let robots come online and publish their state, and let the view refresh."""
        self.online(*robots, colony=colony)
        self.state(*robots, colony=colony, **changes)
        self.advance_s(0.5)

    def events(
        self, robot: int, *events: RobotEvent, colony: str = "blue", told_s: float | None = None
    ) -> None:
        for event in events:
            self._published[IDS[robot]] += 1
            unix_ms = round(1000.0 * (self.at_s if told_s is None else told_s))
            message = EventMessage(IDS[robot], 3, self._published[IDS[robot]], unix_ms, event)
            self.handle("event", ColonyKeys(colony).event(IDS[robot]), message)

    def robot_metadata(
        self,
        robot: int,
        *peers: int,
        colony: str = "blue",
        settings: str = SETTINGS,
    ) -> None:
        about = RobotMetadata(IDS[robot], 3, settings, [IDS[peer] for peer in peers], "")
        self.handle("metadata", ColonyKeys(colony).metadata(IDS[robot]), about)

    def arena_metadata(self, name: str = "lab", settings: str = NATURE) -> None:
        self.handle("online", ArenaKeys(name).alive(7, "a"))
        self.handle("metadata", ArenaKeys(name).metadata, ArenaMetadata(name, 7, settings))

    def scene(
        self,
        *robots: Where,
        arena: str = "lab",
        packs: Sequence[tuple[float, float, float]] = (),
        **changes: Any,
    ) -> None:
        """Let an arena publish a scene with robots and packs (x_m, y_m, charge)."""
        self._scenes += 1
        bodies = [_body(*where) for where in robots]
        seen = [ScenePack(x_m, y_m, 0.0, 1.0, 0.0, charge) for x_m, y_m, charge in packs]
        scene = Scene(arena, 7, self._scenes, 1000, 7, 0.2, 2.0, 2.0, bodies, seen)
        self.handle("scene", ArenaKeys(arena).scene, msgspec.structs.replace(scene, **changes))

    def advance_s(self, seconds: float) -> None:
        """Let time pass, and let the view refresh."""
        self.at_s += seconds
        self.view.refresh(self.at_s)

    def remove_absent(self) -> None:
        """Remove all robots and arenas that are offline, as after a long silence."""
        self.monitor.handle_timeouts(self.at_s + FORGET_S + 1.0)

    def moment(self) -> Moment:
        return Moment(self.at_s, self.view.sim_s() or 0.0, self.view.generation())


def _body(robot: int, x_m: float, y_m: float, heading_rad: float = 0.0) -> SceneRobot:
    return SceneRobot(IDS[robot], "blue", x_m, y_m, heading_rad, False, 0.0, 0.0, 0.0, False)
