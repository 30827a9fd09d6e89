"""A robot with its body: it requests one, steps on its observations, publishes actions, and recovers when others fail.

No clock, no threads, no sockets, as in `RobotNode`: events and the time are arguments. A robot's process runs it by the
clock of its machine, and the fault simulation in virtual time.
"""

import math
from collections.abc import Callable

import msgspec

from crcolony.body.settings import CyberRodent
from crcolony.errors import CrcolonyError
from crcolony.nodes.arena_changes import ArenaChanges
from crcolony.nodes.control_step import ControlStep
from crcolony.nodes.link_recovery import LinkRecovery
from crcolony.nodes.link_to_body import LinkToBody, UnknownArenaError
from crcolony.nodes.node_inputs import EmbodimentOptions, ProcessCallbacks
from crcolony.nodes.reported_settings import settings_of_robot
from crcolony.nodes.robot_node import RobotNode
from crcolony.nodes.waiting_for_body import WaitingForBody
from crcolony.protocol.body_messages import BodyGranted
from crcolony.protocol.codec import VERSION, WireError
from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import decode_scene
from crcolony.robot.batch import step_parameters
from crcolony.transport.interface import (
    ArenaMetadataReceived,
    ArenaOffline,
    ArenaOnline,
    EnvelopeReceived,
    InboundEvent,
    IncompatiblePeer,
    JoinReplyReceived,
    LocalObservation,
    ObservationReceived,
    QueryReceived,
    RobotOffline,
    RobotOnline,
    SceneReceived,
    Transport,
)

_STATE_DELAY_S = 0.1
"""A robot publishes its state this soon after another has come online."""
_JOIN_RETRY_S = 1.0
_OBSERVATION_TIMEOUT_S = 3.0
"""Without an observation for this long a robot requests its body again."""


class DuplicateIdentityError(CrcolonyError):
    """Another process has this robot's key, and was online first."""


class EmbodiedRobot:
    """Drives a `RobotNode` by inbound events, above all by those of its body."""

    def __init__(
        self,
        node: RobotNode,
        transport: Transport,
        options: EmbodimentOptions,
        process: ProcessCallbacks,
    ) -> None:
        self.node = node
        self._transport, self._options, self._process = transport, options, process
        self._config, self._arena = options.config, options.arena
        self._links = LinkRecovery(node.id, node.colony)
        self._body = LinkToBody(
            node.member,
            options.arena,
            options.wanted_slot,
            options.known_arenas,
            options.draw,
            transport.publish_action,
            process.local_link,
        )
        self._control = ControlStep(
            node,
            self._body,
            process.local_link,
            options.config.generations,
            process.print_line,
            self._handle_contact,
        )
        self._join_due_s = self._state_due_s = -math.inf
        self._snapshot_due_s = math.inf
        self._waiting = WaitingForBody(options.arena)
        self._arena_changes = ArenaChanges()
        node.telemetry.settings = settings_of_robot(self._config, self._config.body)

    def start(self, now_s: float) -> None:
        """Start the robot; raises StorageError if the stored one does not fit."""
        self._snapshot_due_s = now_s + self._options.snapshot_s
        self._waiting.start(now_s)
        self.node.start(now_s)

    def release_body(self) -> None:
        """Return the body to the arena, unless it belongs to another process with the same key."""
        request = self._body.leave()
        if request is not None and not self.node.peers.has_duplicate:
            self._transport.request_body(self.node.id, request)

    def report_fault(self, what: str) -> None:
        """Count, publish and print a fault of the outside."""
        self.node.report_fault(what)
        self._process.print_warning(what)

    @property
    def is_done(self) -> bool:
        """Whether it has completed the last generation of its config."""
        return self._control.is_done

    @property
    def can_answer_quietly(self) -> bool:
        """See `ControlStep.can_answer_quietly`."""
        return not self.is_done and self._control.can_answer_quietly

    def answer_quietly(self, wait: Callable[[], float | None]) -> bool:
        """See `ControlStep.answer_quietly`."""
        return self._control.answer_quietly(wait)

    @property
    def has_body(self) -> bool:
        """Whether an arena has granted it a body."""
        return self._body.lease is not None

    @property
    def observed_s(self) -> float:
        """When the last observation, or the grant of the body, arrived."""
        return self._control.observed_s

    @property
    def next_s(self) -> float:
        """When `handle_timers` is due."""
        join_s = max(self._join_due_s, self._control.observed_s + _OBSERVATION_TIMEOUT_S)
        return min(self.node.next_s, self._state_due_s, self._snapshot_due_s, join_s)

    def handle_event(self, now_s: float, event: InboundEvent) -> None:
        """Handle an inbound event. Raises FatalStorageError when the state of the disk is unknown."""
        node = self.node
        match event:
            case ObservationReceived(observation=observation) | (LocalObservation() as observation):
                self._control.handle_observation(now_s, observation)
            case EnvelopeReceived(envelope=envelope):
                node.handle_envelope(now_s, envelope)
                self._control.act_if_settled()
            case RobotOnline(robot=robot, incarnation=incarnation, session=session):
                self._links.handle_online(robot)
                node.handle_peer_online(now_s, robot, incarnation, session)
                self._state_due_s = min(self._state_due_s, now_s + _STATE_DELAY_S)
            case RobotOffline(robot=robot, incarnation=incarnation, session=session):
                node.handle_peer_offline(now_s, robot, incarnation, session)
                if robot not in node.peers:
                    self._links.handle_offline(now_s, robot)
                self._control.act_if_settled()
            case SceneReceived(scene=scene):
                self._handle_scene(now_s, scene)
            case IncompatiblePeer(robot=robot, version=version) if robot not in node.peers:
                self.report_fault(
                    f"robot {robot.hex()[:8]} speaks version {version} of the protocol,"
                    f" this one speaks {VERSION}: they cannot mate"
                )
            case JoinReplyReceived(reply=reply):
                self._handle_join_reply(now_s, reply)
            case ArenaMetadataReceived(metadata=metadata) if self._body.lease:
                self._handle_arena_metadata(metadata, self._body.lease.arena_run)
            case ArenaOnline(arena_run=run):
                if self._body.handle_online(run):
                    self._request_body(now_s)
            case ArenaOffline(arena_run=run):
                if self._body.handle_offline(run):
                    self._lose_body(now_s)
            case QueryReceived(topic="history", payload=payload, reply=send_reply):
                node.reply_history(payload, send_reply)
            case QueryReceived(topic="metadata", payload=payload, reply=send_reply):
                node.reply_metadata(payload, send_reply)

    # The body --------------------------------------------------------------------------------------------------

    def _request_body(self, now_s: float) -> None:
        self._join_due_s = now_s + _JOIN_RETRY_S
        # A duplicate's body belongs to the process that was online first.
        request = None if self.node.peers.has_duplicate else self._body.request()
        if request is not None:
            self._transport.request_body(self.node.id, request)

    def _print_waiting(self, now_s: float) -> None:
        line = self._waiting.line_due(now_s) if self._body.lease is None else None
        if line is not None:
            self._process.print_line(line)

    def _handle_join_reply(self, now_s: float, data: bytes) -> None:
        former_run = self._body.lease.arena_run if self._body.lease else None
        try:
            reply = self._body.open_reply(data)
        except (WireError, UnknownArenaError) as error:
            self.report_fault(f"arena {self._arena}: {error}")
            return
        if isinstance(reply, BodyGranted):
            self._control.observed_s = now_s
            self._use_body(reply, reply.arena_run != former_run)
        elif reply is not None:
            self._waiting.handle_denial(reply.reason)
            self._print_waiting(now_s)

    def _use_body(self, reply: BodyGranted, is_new: bool) -> None:
        node = self.node
        try:
            body = msgspec.json.decode(reply.body, type=CyberRodent)
        except msgspec.DecodeError as error:
            self.report_fault(f"arena {self._arena}: malformed settings of the body: {error}")
            return
        if is_new:
            self._process.print_line(f"has body {reply.slot} in arena {self._arena}")
            self._transport.request_arena_metadata()
        node.arena = self._arena
        if self._options.wanted_slot < 0:
            node.number = reply.slot
        node.set_lockstep(reply.lockstep)
        node.robot.set_parameters(step_parameters(self._config.learning, self._config.life, body))
        node.telemetry.settings = settings_of_robot(self._config, body)

    def _handle_arena_metadata(self, data: bytes, arena_run: int) -> None:
        try:
            metadata = self._body.open_telemetry(data)
            if changes := self._arena_changes.handle_metadata(metadata, arena_run):
                self._process.print_line(changes)
        except WireError as error:
            self.report_fault(f"arena {self._arena}: malformed metadata: {error}")

    def _lose_body(self, now_s: float) -> None:
        self._process.print_line(self._waiting.handle_loss())
        self.node.arena = ""
        self._request_body(now_s)  # of another run that is online already

    # The clock -------------------------------------------------------------------------------------------------

    def handle_timers(self, now_s: float) -> None:
        """Do what is due. Raises DuplicateIdentityError, and FatalStorageError if the state of the disk is unknown."""
        node = self.node
        if now_s >= node.next_s:
            node.handle_timeouts(now_s)
            self._control.act_if_settled()
        if now_s >= self._state_due_s:
            self._state_due_s = now_s + self._options.state_period_s
            node.publish_state(self._process.count_dropped())
            if self._body.lease is None:
                node.telemetry.publish_activity(self._waiting.reason)
        if now_s >= self._join_due_s and now_s >= self._control.observed_s + _OBSERVATION_TIMEOUT_S:
            self._request_body(now_s)
            self._print_waiting(now_s)
        self._links.remove_expired(now_s)
        self._transport.subscribe_scene(self._links.needs_scene)
        duplicate = node.peers.duplicate_session(now_s)
        if duplicate is not None:
            raise DuplicateIdentityError(
                f"robot {node.id.hex()} runs already in another process (session {duplicate});"
                " every robot needs a key of its own"
            )
        if now_s >= self._snapshot_due_s:
            self._snapshot_due_s = now_s + self._options.snapshot_s
            node.save()

    def _handle_contact(self, now_s: float, robot: RobotId) -> None:
        is_online = robot in self.node.peers
        self._reconnect(now_s, self._links.handle_contact(now_s, robot, is_online))

    def _handle_scene(self, now_s: float, data: bytes) -> None:
        try:
            scene = decode_scene(self._body.open_telemetry(data))
        except WireError as error:
            self.node.report_fault(f"malformed scene: {error}")
            return
        self._reconnect(now_s, self._links.handle_scene(now_s, scene))

    def _reconnect(self, now_s: float, reason: str | None) -> None:
        if reason is None:
            return
        self.report_fault(f"{reason}: reconnecting")
        self._process.reconnect()
        for peer in self.node.handle_reconnection(now_s):
            self._links.handle_offline(now_s, peer)
        self._control.act_if_settled()
