"""One robot without a network, for tests: what it sends is recorded, and events are passed to it directly."""

import secrets
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np

from crcolony.body.contract import OBSERVATION_WIDTH
from crcolony.body.settings import CyberRodent
from crcolony.body_server.body_links import BodyLinks
from crcolony.nodes.embodied_robot import EmbodiedRobot
from crcolony.nodes.node_inputs import (
    ColonyMember,
    EmbodimentOptions,
    NodeResources,
    ProcessCallbacks,
)
from crcolony.nodes.robot_node import RobotNode
from crcolony.protocol.body_messages import (
    Action,
    BodyDenied,
    BodyGranted,
    Contact,
    Join,
    Leave,
    Observation,
    decode_action,
    pack_row,
)
from crcolony.protocol.body_requests import Request, open_request, sign_reply
from crcolony.protocol.codec import encode
from crcolony.protocol.identity import Identity, RobotId, seeded
from crcolony.protocol.link_keys import CODE_BYTES
from crcolony.protocol.signed_telemetry import (
    open_telemetry,
    purpose_of_arena,
    sign_telemetry,
)
from crcolony.protocol.telemetry_messages import RobotEvent, Scene, SceneRobot
from crcolony.robot.factory import make_robots, own_streams
from crcolony.robot.state import SLICE_OVER
from crcolony.storage.store import RobotStore
from crcolony.transport.interface import (
    ArenaMetadataReceived,
    ArenaOffline,
    ArenaOnline,
    JoinReplyReceived,
    LinkOnThisMachine,
    NoLinkOnThisMachine,
    ObservationReceived,
    QueryReceived,
    SceneReceived,
    TelemetryTopic,
)
from tests.support.small_colony import small

COLONY, ARENA_RUN = "blue", 7
ARENA_KEY = seeded("arena", 1, 0)
_LONG_AFTER_S = 1e6
ME, PEER = sorted((seeded(COLONY, 1, k) for k in range(2)), key=lambda key: key.id)
ZERO_ROW = pack_row(np.zeros(OBSERVATION_WIDTH))
BODY = msgspec.json.encode(CyberRodent()).decode()


class RecordingTransport:
    """A transport that records what a robot sends."""

    def __init__(self) -> None:
        self.requests: list[bytes] = []
        self.actions: list[Action] = []
        self.telemetry: list[tuple[str, bytes]] = []
        """Topic and message"""
        self.is_scene_needed = False
        self.metadata_requests = 0

    def send_envelope(self, to: RobotId, envelope: bytes) -> None: ...

    def request_body(self, robot: RobotId, request: bytes) -> None:
        self.requests.append(request)

    def request_arena_metadata(self) -> None:
        self.metadata_requests += 1

    def publish_action(self, robot: RobotId, action: bytes) -> None:
        self.actions.append(decode_action(action[:-CODE_BYTES]))

    def publish_telemetry(self, robot: RobotId, topic: TelemetryTopic, data: bytes) -> None:
        self.telemetry.append((topic, open_telemetry(data).content))

    def subscribe_scene(self, is_needed: bool) -> None:
        self.is_scene_needed = is_needed


class LoneRobot:
    """An embodied robot, started at time 0, with its store in `folder`; `local` is its link on its own machine."""

    def __init__(self, folder: Path, local: LinkOnThisMachine | None = None) -> None:
        config = small()
        batch, _, (robot,) = make_robots(config, [ME.id.hex()], own_streams([ME.id]))
        schema = bytes.fromhex(robot.subpopulation.schema.digest)
        self.store = RobotStore(folder / "robot.sqlite", ME.id, schema, durable=False)
        self.transport = RecordingTransport()
        self.lines: list[str] = []
        """What it printed"""
        self.events: list[RobotEvent] = []
        self.reconnections = 0
        self._arenas: dict[int, BodyLinks] = {}
        """By run, the other end of the robot's link"""
        self._arena_run = ARENA_RUN
        self.batch, self.unix_s = batch, 1_000.0
        member = ColonyMember(ME, COLONY, 0, self.store.begin_incarnation(5))
        resources = NodeResources(
            self.store, self.transport, lambda: self.unix_s, self.events.append
        )
        self.node = RobotNode(member, robot, batch, resources)
        self.node.peers.session = "mine"
        self.robot = EmbodiedRobot(
            self.node,
            self.transport,
            EmbodimentOptions(config, "here"),
            ProcessCallbacks(
                self._reconnect,
                self.lines.append,
                print_warning=self.lines.append,
                local_link=local or NoLinkOnThisMachine(),
            ),
        )
        self.robot.start(0.0)

    def _reconnect(self) -> None:
        self.reconnections += 1

    @property
    def requested(self) -> list[Join | Leave]:
        """What it has requested of arenas."""
        return [open_request(data).message for data in self.transport.requests]

    def grant_body(
        self,
        now_s: float,
        tick: int = 0,
        lockstep: bool = False,
        arena_run: int = ARENA_RUN,
        body: str = BODY,
    ) -> None:
        """Let a run of its arena come online, in place of the former one, and grant it a body in slot 2."""
        if arena_run != self._arena_run:
            self.robot.handle_event(now_s, ArenaOffline(self._arena_run))
        self._arena_run = arena_run
        self.robot.handle_event(now_s, ArenaOnline(arena_run))
        links = self._arenas.setdefault(
            arena_run, BodyLinks("here", arena_run, ARENA_KEY, secrets.token_bytes)
        )
        request = links.receive(_LONG_AFTER_S + now_s, ME.id, self.transport.requests[-1])
        assert isinstance(request, Request)
        reply = links.grant(
            request,
            lambda digest, key: BodyGranted(digest, key, 2, arena_run, tick, 0.1, lockstep, body),
        )
        self.robot.handle_event(now_s, JoinReplyReceived(ME.id, reply))

    def reply(self, now_s: float, reply: Callable[[bytes], BodyGranted | BodyDenied]) -> None:
        """Let its arena reply to its last request; `reply` makes the message from the request's digest."""
        request = open_request(self.transport.requests[-1])
        data = sign_reply(reply(request.digest), "here", ARENA_KEY)
        self.robot.handle_event(now_s, JoinReplyReceived(ME.id, data))

    def observe(
        self,
        now_s: float,
        tick: int,
        arena_run: int = ARENA_RUN,
        row: bytes = ZERO_ROW,
        contact: Contact | None = None,
    ) -> None:
        """Deliver an observation."""
        observation = encode(Observation(arena_run, tick, row, contact))
        links = self._arenas.get(self._arena_run)
        sealed = links.seal_observation(ME.id, observation) if links else None
        self.robot.handle_event(now_s, ObservationReceived(ME.id, sealed or bytes(99)))

    def deliver_scene(self, now_s: float, is_lit: bool) -> None:
        """Deliver a scene with the body of `PEER`, with its lamp on or off."""
        scene = sign_telemetry(
            encode(scene_of(PEER.id, is_lit)), purpose_of_arena("here"), ARENA_KEY
        )
        self.robot.handle_event(now_s, SceneReceived(scene))

    def deliver_metadata(self, now_s: float, metadata: bytes, arena: Identity = ARENA_KEY) -> None:
        """Deliver its arena's reply about its settings, signed by an arena."""
        signed = sign_telemetry(metadata, purpose_of_arena("here"), arena)
        self.robot.handle_event(now_s, ArenaMetadataReceived(signed))

    def query(self, topic: Literal["history", "metadata"], request: bytes) -> list[bytes]:
        """Return the replies to a query."""
        replies: list[bytes] = []
        self.robot.handle_event(0.0, QueryReceived(topic, ME.id, request, replies.append))
        return [open_telemetry(reply).content for reply in replies]

    def set_captures(self, captures: Sequence[int]) -> None:
        """Set how many batteries each agent has captured in its lifetime."""
        self.batch.captures[0] = captures

    def turn_over(self) -> None:
        """End the last slice of a generation."""
        generation = self.node.robot.generation
        while self.node.robot.generation == generation:
            self.batch.events[0] = SLICE_OVER
            self.node.advance_slice()

    @property
    def acted(self) -> list[int]:
        """The ticks of its actions."""
        return [action.tick for action in self.transport.actions]


def scene_of(robot: RobotId, is_lit: bool, colony: str = COLONY) -> Scene:
    """Return a scene with one body."""
    body = SceneRobot(robot, colony, 0.0, 0.0, 0.0, False, float(is_lit), 0.0, 0.0, False)
    return Scene("here", ARENA_RUN, 1, 1, 0, 0.1, 1.0, 1.0, [body], [])
