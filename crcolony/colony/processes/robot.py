"""The process of one robot: it looks for a body, lives with it, and goes on living when anything else dies."""

import time
from collections.abc import Callable

import msgspec
import zenoh

from crcolony.colony import telemetry
from crcolony.colony.identity import RobotId
from crcolony.colony.inbox import Inbox
from crcolony.colony.messages import (
    VERSION,
    Action,
    Embodied,
    Join,
    Leave,
    Observation,
    WireError,
    decode_observation,
    decode_place,
    encode,
    pack_row,
    unpack_row,
)
from crcolony.colony.node import RobotNode
from crcolony.colony.telemetry import Ended, Exchanged, decode_scene
from crcolony.colony.transport import (
    ArenaGone,
    ArenaSeen,
    Arrival,
    Asked,
    Mail,
    NetworkError,
    Observed,
    Placed,
    RobotGone,
    RobotSeen,
    Shown,
    StrangerSeen,
)
from crcolony.colony.zenoh_transport import RobotTransport
from crcolony.compiled import FloatArray
from crcolony.config import Config
from crcolony.errors import Refusal
from crcolony.robot.batch import habits_of
from crcolony.world.settings import CyberRodent

STATE_PERIOD_S, _NEWS_S = 0.5, 0.1
"""How often a robot tells how it is, and how soon after another has come."""
_JOIN_RETRY_S = 1.0
_SILENCE_S = 3.0
"""Without an observation for so long a robot asks for its body again."""
_LONGEST_WAIT_S = 0.5
_REOPEN_S, _COMPLAINT_S = 60.0, 30.0
_MOST_UNSEEN = 1000
_UNSEEN_S = 5.0
"""Who is met and not seen for so long is cut off from this robot alone: a mesh that is whole but for that stays so."""


class TwinError(Refusal):
    """Another process has this robot's key, and was there first."""


class RobotProcess:
    """Drives a `RobotNode` by what arrives from the network and by the clock of this machine."""

    def __init__(
        self,
        node: RobotNode,
        transport: RobotTransport,
        inbox: Inbox,
        config: Config,
        colony: str,
        arena: str,
        wanted_place: int,
        snapshot_s: float,
        reopen: Callable[[], zenoh.Session],
        say: Callable[[str], None],
    ) -> None:
        self._node, self._transport, self._inbox = node, transport, inbox
        self._config, self._colony, self._arena = config, colony, arena
        self._wanted_place = wanted_place
        self._reopen, self._say = reopen, say
        self._reopen_due_s = 0.0
        self._unseen: dict[RobotId, float] = {}
        """Robots that were met and cannot be seen on the network, and since when"""
        self._missed: dict[RobotId, float] = {}
        """Robots that are on the network no more, and since when"""
        self._complaint_s = time.monotonic() + _SILENCE_S
        self._place: Embodied | None = None
        self._action = b""
        """For the last observation"""
        self._answer: bytes | None = None
        """The same, once it may be said: a mating holds it back"""
        self._tick = -1
        self._observed_s = self._join_s = self._state_s = 0.0
        self._snapshot_s = snapshot_s
        self._snapshot_due_s = time.monotonic() + snapshot_s
        self._is_stopped: Callable[[], bool] = lambda: False

    def run(self, is_stopped: Callable[[], bool]) -> None:
        """Live until told to stop or until the last generation of the config; everything is saved then."""
        self._is_stopped = is_stopped
        self._node.session = self._transport.name
        self._node.begin(time.monotonic())
        self._transport.host(self._node.id, self._node.life)
        try:
            while not is_stopped() and not self._is_done():
                now_s = time.monotonic()
                wait_s = min(self._node.next_s - now_s, self._state_s - now_s, _LONGEST_WAIT_S)
                arrival = self._inbox.get(max(wait_s, 0.0))
                if arrival is not None:
                    self._take(time.monotonic(), arrival)
                self._keep_time(time.monotonic())
        finally:
            if not self._node.has_twin:
                self._transport.join(self._node.id, encode(Leave(self._node.id)))
            self._transport.unhost(self._node.id)
        self._node.save()

    def _is_done(self) -> bool:
        return 0 < self._config.generations <= self._node.robot.generation

    def _take(self, now_s: float, arrival: Arrival) -> None:
        node = self._node
        match arrival:
            case Observed(observation=data):
                self._observe(now_s, data)
            case Mail(letter=letter):
                node.receive(now_s, letter)
                self._answer_if_settled()
            case RobotSeen(robot=robot, life=life, session=session):
                self._unseen.pop(robot, None)
                self._missed.pop(robot, None)
                node.robot_seen(now_s, robot, life, session)
                self._state_s = min(self._state_s, now_s + _NEWS_S)
            case RobotGone(robot=robot, life=life, session=session):
                node.robot_gone(now_s, robot, life, session)
                if robot not in node.peers and len(self._missed) < _MOST_UNSEEN:
                    self._missed[robot] = now_s
                self._answer_if_settled()
            case Shown(scene=scene):
                self._search(now_s, scene)
            case StrangerSeen(robot=robot, version=version) if robot not in node.peers:
                self._say_fault(
                    f"robot {robot.hex()[:8]} speaks version {version} of the protocol,"
                    f" this one speaks {VERSION}: they cannot mate"
                )
            case Placed(answer=answer):
                self._embody(now_s, answer)
            case ArenaSeen():
                self._seek(now_s)
            case ArenaGone(world=world) if self._place and world == self._place.world:
                self._lose_body("the arena is gone")
            case Asked(question=question, answer=reply):
                self._answer_past(question, reply)

    def _answer_past(self, question: bytes, reply: Callable[[bytes], None]) -> None:
        try:
            reply(self._node.answer_past(question))
        except WireError as error:
            self._node.fault(f"malformed question: {error}")

    # The body --------------------------------------------------------------------------------------------------

    def _seek(self, now_s: float) -> None:
        if self._node.has_twin:
            return  # the body belongs to whoever was there first
        self._join_s = now_s + _JOIN_RETRY_S
        join = Join(self._node.id, self._colony, self._wanted_place)
        self._transport.join(self._node.id, encode(join))

    def _say_if_lost(self, now_s: float, why: str) -> None:
        """Tell a person, now and then, that there is no body to live in."""
        if self._place is None and now_s >= self._complaint_s:
            self._complaint_s = now_s + _COMPLAINT_S
            self._say_fault(why)

    def _embody(self, now_s: float, answer: bytes) -> None:
        try:
            place = decode_place(answer)
            if not isinstance(place, Embodied):
                self._say_if_lost(now_s, f"no body: arena {self._arena} is {place.reason}")
                return
            body = msgspec.json.decode(place.body, type=CyberRodent)
        except (WireError, msgspec.DecodeError) as error:
            self._say_fault(f"arena {self._arena}: malformed answer: {error}")
            return
        if self._place is None or place.world != self._place.world:
            self._say(f"has body {place.place} in arena {self._arena}")
            self._tick = -1
        self._tick = min(self._tick, place.tick)  # of a tick that is not yet, somebody lied
        self._place, self._observed_s = place, now_s
        self._node.arena = self._arena
        if self._wanted_place < 0:
            self._node.number = place.place
        self._node.keep_pace(place.lockstep)
        self._node.robot.embody(habits_of(self._config.learning, self._config.life, body))

    def _lose_body(self, why: str) -> None:
        self._say_fault(f"{why}; looking for arena {self._arena}")
        self._place, self._node.arena = None, ""

    def _observe(self, now_s: float, data: bytes) -> None:
        try:
            observation = decode_observation(data)
            row = unpack_row(observation.row)
        except WireError as error:
            self._node.fault(f"malformed observation: {error}")
            return
        place = self._place
        if place is None or observation.world != place.world:
            return
        if observation.tick <= self._tick:
            if observation.tick == self._tick and self._answer is not None and place.lockstep:
                self._transport.act(self._node.id, self._answer)
            return
        self._node.period_ms = 1000.0 * (now_s - self._observed_s)
        self._observed_s, self._tick = now_s, observation.tick
        self._live(now_s, observation, self._node.robot.step(row))

    def _live(self, now_s: float, observation: Observation, action: FloatArray) -> None:
        node = self._node
        self._answer, self._action = None, encode(Action(observation.tick, pack_row(action)))
        if observation.contact is not None:
            self._look_for(now_s, observation.contact.robot)
        node.attend(now_s, observation.tick, observation.contact)
        self._answer_if_settled()

    def _answer_if_settled(self) -> None:
        """Act, and go on to what comes after the step; in lockstep only when no mating is under way."""
        place, node = self._place, self._node
        if place is None or self._answer is not None or self._tick < 0:
            return
        if place.lockstep and not node.is_settled:
            return
        generation = node.robot.generation
        self._answer = self._action
        if node.robot.events:
            node.finish_step()
        if not self._is_done():
            self._transport.act(node.id, self._answer)
        if node.robot.generation > generation:
            self._say(f"generation {node.robot.generation}, {node.matings} matings so far")

    # The clock -------------------------------------------------------------------------------------------------

    def _keep_time(self, now_s: float) -> None:
        node = self._node
        if now_s >= node.next_s:
            node.let_time_pass(now_s)
            self._answer_if_settled()
        if now_s >= self._state_s:
            self._state_s = now_s + STATE_PERIOD_S
            self._transport.tell(node.id, "state", encode(node.state(self._inbox.dropped)))
        if now_s >= self._join_s and now_s >= self._observed_s + _SILENCE_S:
            self._seek(now_s)
            self._say_if_lost(now_s, f"no body yet; looking for arena {self._arena}")
        for robot in [r for r, at_s in self._missed.items() if now_s - at_s > _REOPEN_S]:
            del self._missed[robot]
        self._transport.is_searching = bool(self._missed)
        twin = node.twin(now_s)
        if twin is not None:
            raise TwinError(
                f"robot {node.id.hex()} lives already in another process (session {twin});"
                " every robot needs a key of its own"
            )
        for peer in self._transport.peers_without_token(now_s):
            self._say_fault(f"peer {peer} has no token: a stranger, or a robot that is not seen")
        if now_s >= self._snapshot_due_s:
            self._snapshot_due_s = now_s + self._snapshot_s
            node.save()

    def _look_for(self, now_s: float, met: RobotId) -> None:
        """Notice that a link is lost, though both see the arena: a robot's body is met, and its token is not seen."""
        if met in self._node.peers:
            self._unseen.pop(met, None)
        elif len(self._unseen) >= _MOST_UNSEEN:
            self._unseen.clear()
        elif now_s - self._unseen.setdefault(met, now_s) >= _UNSEEN_S:
            self._come_anew(now_s, f"robot {met.hex()[:8]} is met and cannot be seen")

    def _search(self, now_s: float, data: bytes) -> None:
        """Notice that a link is lost, though nobody died: the arena shows a missed robot with its lamp lit.

        The lamp of a robot that is gone goes out with its last action's time to live. The smaller id mends it first.
        """
        try:
            scene = decode_scene(data)
        except WireError as error:
            self._node.fault(f"malformed scene: {error}")
            return
        for seen in scene.robots:
            missed_s = now_s - self._missed.get(seen.robot, now_s)
            patience_s = _UNSEEN_S if self._node.id < seen.robot else 3.0 * _UNSEEN_S
            is_lit = seen.red + seen.green + seen.blue > 0.0
            if is_lit and missed_s >= patience_s and seen.colony == self._colony:
                self._come_anew(now_s, f"robot {seen.robot.hex()[:8]} lives and cannot be seen")
                return

    def _come_anew(self, now_s: float, why: str) -> None:
        if now_s < self._reopen_due_s:
            return
        self._reopen_due_s = now_s + _REOPEN_S
        self._unseen.clear()
        self._missed.clear()
        self._say_fault(f"{why}: coming onto the network anew")
        while not self._is_stopped():
            try:
                self._transport.move(self._reopen)
            except NetworkError as error:  # a router that is away just now
                self._say(f"{error}; trying again")
                self._inbox.get(_LONGEST_WAIT_S)
            else:
                self._node.session = self._transport.name
                return

    def _say_fault(self, what: str) -> None:
        self._node.fault(what)
        self._say(what)


def in_words(event: telemetry.Event) -> str | None:
    """Return what an event means to a person, or None if it is too common to say."""
    match event:
        case Exchanged(partner=partner, conceived=conceived, energy=energy):
            what = "conceived" if conceived else "no offspring"
            return f"mated with {partner[:8]}…, {what} (energy {energy:.2f})"
        case Ended(outcome=outcome, peer=peer, reason=reason) if outcome != "mated":
            return f"mating with {peer.hex()[:8]}: {outcome} {reason}".rstrip()
    return None
