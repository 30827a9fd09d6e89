"""A robot with its body: it looks for one, lives with it, keeps time, and goes on living when anything else dies.

No clock, no threads, no sockets, as in `node.py`: what arrives and what time it is are passed in. `processes/robot.py`
runs it by the clock of this machine, and `simulation/` in virtual time.
"""

import math
from collections.abc import Callable

import msgspec

from crcolony.body.settings import CyberRodent
from crcolony.compiled import FloatArray
from crcolony.config import Config
from crcolony.errors import CrcolonyError
from crcolony.nodes.reported_settings import settings_of_robot
from crcolony.nodes.robot_node import RobotNode
from crcolony.protocol.body_messages import (
    Action,
    BodyGranted,
    Join,
    Leave,
    Observation,
    decode_join_reply,
    decode_observation,
    pack_row,
    unpack_row,
)
from crcolony.protocol.codec import VERSION, WireError, encode
from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import decode_scene
from crcolony.robot.batch import step_parameters
from crcolony.transport.interface import (
    ArenaOffline,
    ArenaOnline,
    EnvelopeReceived,
    InboundEvent,
    IncompatiblePeer,
    JoinReplyReceived,
    ObservationReceived,
    QueryReceived,
    RobotOffline,
    RobotOnline,
    SceneReceived,
    Transport,
)

STATE_PERIOD_S, _NEWS_S = 0.5, 0.1
"""How often a robot tells how it is, and how soon after another has come."""
_JOIN_RETRY_S = 1.0
_SILENCE_S = 3.0
"""Without an observation for so long a robot asks for its body again."""
_ANEW_S, _COMPLAINT_S = 30.0, 30.0
"""A robot comes onto the network anew, and complains of what it lacks, not more often than this."""
_FORGET_S = 300.0
"""Whoever has been missed for so long is looked for no more."""
_MAX_UNSEEN = 1000
_UNSEEN_S = 5.0
"""Who is met and not seen for so long is cut off from this robot alone: a mesh that is whole but for that stays so."""


class DuplicateIdentityError(CrcolonyError):
    """Another process has this robot's key, and was there first."""


class EmbodiedRobot:
    """Drives a `RobotNode` by what arrives, for its body above all.

    `wanted_place` is where in the arena it would like to be, -1 for anywhere. `reconnect` leaves the network and comes
    back; `dropped` tells how much was lost of what came in.
    """

    def __init__(
        self,
        node: RobotNode,
        transport: Transport,
        config: Config,
        arena: str,
        wanted_slot: int,
        snapshot_s: float,
        reconnect: Callable[[], None],
        print_line: Callable[[str], None] = lambda line: None,
        dropped: Callable[[], int] = lambda: 0,
        state_period_s: float = STATE_PERIOD_S,
    ) -> None:
        self.node = node
        self._transport, self._config, self._arena = transport, config, arena
        self._wanted_slot = wanted_slot
        self._reconnect_session, self._print_line, self._dropped = reconnect, print_line, dropped
        self._anew_due_s = -math.inf
        self._unseen: dict[RobotId, float] = {}
        """Robots that were met and cannot be seen on the network, and since when"""
        self._missed: dict[RobotId, float] = {}
        """Robots that are on the network no more, and since when"""
        self._body_lease: BodyGranted | None = None
        self._action = b""
        """For the last observation"""
        self._answer: bytes | None = None
        """The same, once it may be said: a mating holds it back"""
        self._tick = -1
        self._observed_s = self._join_due_s = self._state_due_s = -math.inf
        self._snapshot_s, self._state_period_s = snapshot_s, state_period_s
        self._snapshot_due_s = self._complaint_due_s = math.inf
        node.settings = settings_of_robot(config, config.body)

    def start(self, now_s: float) -> None:
        """Come to life; raises StorageError if the memory does not fit."""
        self._snapshot_due_s = now_s + self._snapshot_s
        self._complaint_due_s = now_s + _SILENCE_S
        self.node.start(now_s)

    def release_body(self) -> None:
        """Give the body back, unless it is a twin's."""
        if not self.node.has_duplicate:
            self._transport.request_body(self.node.id, encode(Leave(self.node.id)))

    def report_fault(self, what: str) -> None:
        """Count something outside that went wrong, tell of it, and say it."""
        self.node.report_fault(what)
        self._print_line(what)

    @property
    def is_done(self) -> bool:
        """Whether it has lived through the last generation of its config."""
        return 0 < self._config.generations <= self.node.robot.generation

    @property
    def has_body(self) -> bool:
        """Whether it has a body, as far as it knows."""
        return self._body_lease is not None

    @property
    def observed_s(self) -> float:
        """When its body was last heard of."""
        return self._observed_s

    @property
    def next_s(self) -> float:
        """When `handle_timers` has something to do."""
        seek_s = max(self._join_due_s, self._observed_s + _SILENCE_S)
        return min(self.node.next_s, self._state_due_s, self._snapshot_due_s, seek_s)

    def handle_event(self, now_s: float, event: InboundEvent) -> None:
        """See to what has arrived. Raises FatalStorageError when nobody knows what is on the disk."""
        node = self.node
        match event:
            case ObservationReceived(observation=data):
                self._observe(now_s, data)
            case EnvelopeReceived(envelope=envelope):
                node.handle_envelope(now_s, envelope)
                self._answer_if_settled()
            case RobotOnline(robot=robot, incarnation=incarnation, session=session):
                self._unseen.pop(robot, None)
                self._missed.pop(robot, None)
                node.handle_peer_online(now_s, robot, incarnation, session)
                self._state_due_s = min(self._state_due_s, now_s + _NEWS_S)
            case RobotOffline(robot=robot, incarnation=incarnation, session=session):
                node.handle_peer_offline(now_s, robot, incarnation, session)
                if robot not in node.peers and len(self._missed) < _MAX_UNSEEN:
                    self._missed[robot] = now_s
                self._answer_if_settled()
            case SceneReceived(scene=scene):
                self._search(now_s, scene)
            case IncompatiblePeer(robot=robot, version=version) if robot not in node.peers:
                self.report_fault(
                    f"robot {robot.hex()[:8]} speaks version {version} of the protocol,"
                    f" this one speaks {VERSION}: they cannot mate"
                )
            case JoinReplyReceived(reply=reply):
                self._embody(now_s, reply)
            case ArenaOnline():
                self._seek(now_s)
            case ArenaOffline(arena_run=run) if (
                self._body_lease and run == self._body_lease.arena_run
            ):
                self._lose_body("the arena is gone")
            case QueryReceived(topic="history", payload=payload, reply=answer):
                node.reply_history(payload, answer)
            case QueryReceived(topic="metadata", payload=payload, reply=answer):
                node.reply_metadata(payload, answer)

    # The body --------------------------------------------------------------------------------------------------

    def _seek(self, now_s: float) -> None:
        self._join_due_s = now_s + _JOIN_RETRY_S
        if not self.node.has_duplicate:  # the body belongs to whoever was there first
            join = Join(self.node.id, self.node.colony, self._wanted_slot)
            self._transport.request_body(self.node.id, encode(join))

    def _say_if_lost(self, now_s: float, why: str) -> None:
        """Tell a person, now and then, that there is no body to live in."""
        if self._body_lease is None and now_s >= self._complaint_due_s:
            self._complaint_due_s = now_s + _COMPLAINT_S
            self.report_fault(why)

    def _embody(self, now_s: float, answer: bytes) -> None:
        try:
            slot = decode_join_reply(answer)
            if not isinstance(slot, BodyGranted):
                self._say_if_lost(now_s, f"no body: arena {self._arena} is {slot.reason}")
                return
            body = msgspec.json.decode(slot.body, type=CyberRodent)
        except (WireError, msgspec.DecodeError) as error:
            self.report_fault(f"arena {self._arena}: malformed answer: {error}")
            return
        if self._body_lease is None or slot.arena_run != self._body_lease.arena_run:
            self._print_line(f"has body {slot.slot} in arena {self._arena}")
            self._tick = -1
        self._tick = min(self._tick, slot.tick)  # of a tick that is not yet, somebody lied
        self._body_lease, self._observed_s = slot, now_s
        self.node.arena = self._arena
        if self._wanted_slot < 0:
            self.node.number = slot.slot
        self.node.set_lockstep(slot.lockstep)
        self.node.robot.set_parameters(
            step_parameters(self._config.learning, self._config.life, body)
        )
        self.node.settings = settings_of_robot(self._config, body)

    def _lose_body(self, why: str) -> None:
        self.report_fault(f"{why}; looking for arena {self._arena}")
        self._body_lease, self.node.arena = None, ""

    def _observe(self, now_s: float, data: bytes) -> None:
        try:
            observation = decode_observation(data)
            row = unpack_row(observation.row)
        except WireError as error:
            self.node.report_fault(f"malformed observation: {error}")
            return
        slot = self._body_lease
        if slot is None or observation.arena_run != slot.arena_run:
            return
        if observation.tick <= self._tick:
            if observation.tick == self._tick and self._answer is not None and slot.lockstep:
                self._transport.publish_action(self.node.id, self._answer)
            return
        self.node.period_ms = min(1000.0 * (now_s - self._observed_s), 1e9)
        self._observed_s, self._tick = now_s, observation.tick
        self._live(now_s, observation, self.node.robot.step(row))

    def _live(self, now_s: float, observation: Observation, action: FloatArray) -> None:
        node = self.node
        self._answer, self._action = None, encode(Action(observation.tick, pack_row(action)))
        if observation.contact is not None:
            self._look_for(now_s, observation.contact.robot)
        node.handle_step_events(now_s, observation.tick, observation.contact)
        self._answer_if_settled()

    def _answer_if_settled(self) -> None:
        """Act, and go on to what comes after the step; in lockstep only when no mating is under way."""
        slot, node = self._body_lease, self.node
        if slot is None or self._answer is not None or self._tick < 0:
            return
        if slot.lockstep and not node.is_settled:
            return
        generation = node.robot.generation
        self._answer = self._action
        if node.robot.events:
            node.advance_slice()
        if not self.is_done:
            self._transport.publish_action(node.id, self._answer)
        if node.robot.generation > generation:
            self._print_line(f"generation {node.robot.generation}, {node.matings} matings so far")

    # The clock -------------------------------------------------------------------------------------------------

    def handle_timers(self, now_s: float) -> None:
        """Do what is due. Raises DuplicateIdentityError, and FatalStorageError when nobody knows what is on the disk."""
        node = self.node
        if now_s >= node.next_s:
            node.handle_timeouts(now_s)
            self._answer_if_settled()
        if now_s >= self._state_due_s:
            self._state_due_s = now_s + self._state_period_s
            node.publish_state(self._dropped())
        if now_s >= self._join_due_s and now_s >= self._observed_s + _SILENCE_S:
            self._seek(now_s)
            self._say_if_lost(now_s, f"no body yet; looking for arena {self._arena}")
        for robot in [r for r, at_s in self._missed.items() if now_s - at_s > _FORGET_S]:
            del self._missed[robot]
        self._transport.subscribe_scene(bool(self._missed))
        twin = node.duplicate_session(now_s)
        if twin is not None:
            raise DuplicateIdentityError(
                f"robot {node.id.hex()} lives already in another process (session {twin});"
                " every robot needs a key of its own"
            )
        if now_s >= self._snapshot_due_s:
            self._snapshot_due_s = now_s + self._snapshot_s
            node.save()

    def _look_for(self, now_s: float, met: RobotId) -> None:
        """Notice that a link is lost, though both see the arena: a robot's body is met, and its token is not seen."""
        if met in self.node.peers:
            self._unseen.pop(met, None)
        elif len(self._unseen) >= _MAX_UNSEEN:
            self._unseen.clear()
        elif now_s - self._unseen.setdefault(met, now_s) >= _UNSEEN_S:
            self._reconnect(now_s, f"robot {met.hex()[:8]} is met and cannot be seen")

    def _search(self, now_s: float, data: bytes) -> None:
        """Notice that a link is lost, though nobody died: the arena shows a missed robot with its lamp lit.

        The lamp of a robot that is gone goes out with its last action's time to live. The smaller id mends it first.
        """
        try:
            scene = decode_scene(data)
        except WireError as error:
            self.node.report_fault(f"malformed scene: {error}")
            return
        for seen in scene.robots:
            missed_s = now_s - self._missed.get(seen.robot, now_s)
            patience_s = _UNSEEN_S if self.node.id < seen.robot else 3.0 * _UNSEEN_S
            is_lit = seen.red + seen.green + seen.blue > 0.0
            if is_lit and missed_s >= patience_s and seen.colony == self.node.colony:
                self._reconnect(now_s, f"robot {seen.robot.hex()[:8]} lives and cannot be seen")
                return

    def _reconnect(self, now_s: float, why: str) -> None:
        if now_s < self._anew_due_s:
            return
        self._anew_due_s = now_s + _ANEW_S
        self._unseen.clear()
        self.report_fault(f"{why}: coming onto the network anew")
        self._reconnect_session()
        for peer, incarnations in list(self.node.peers.items()):  # nobody is seen from there yet
            for incarnation, session in list(incarnations):
                self.handle_event(now_s, RobotOffline(peer, incarnation, session))
