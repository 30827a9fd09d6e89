"""The keys of one robot on Zenoh (PROTOCOL.md, "Keys"). What arrives waits in one queue, for one thread."""

import contextlib
import json
import threading
from collections.abc import Callable
from queue import Empty, Full, Queue
from typing import Any, Final, NamedTuple

import zenoh

from tests.foreign.messages import ENVELOPE_BYTES

MOST_WAITING: Final = 1000
JOIN_TIMEOUT_S: Final = 1.0


class EnvelopeArrived(NamedTuple):
    payload: bytes


class ObservationArrived(NamedTuple):
    payload: bytes


class BodyReply(NamedTuple):
    payload: bytes


class MetadataReply(NamedTuple):
    payload: bytes


class PeerToken(NamedTuple):
    robot: bytes
    incarnation: int
    session: str
    is_online: bool


class ArenaToken(NamedTuple):
    arena_run: int
    session: str
    is_online: bool


class Question(NamedTuple):
    """A query of an observer; `reply` may be called once, from any thread."""

    topic: str
    payload: bytes
    reply: Callable[[bytes], None]


Input = (
    EnvelopeArrived
    | ObservationArrived
    | BodyReply
    | MetadataReply
    | PeerToken
    | ArenaToken
    | Question
)


def zenoh_config(endpoint: str) -> zenoh.Config:
    """A peer of a mesh: it connects to a seed and learns of the others by gossip."""
    config = {
        "mode": "peer",
        "connect": {"endpoints": [endpoint]},
        "listen": {"endpoints": ["tcp/127.0.0.1:0"]},
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": True}},
        "transport": {
            "link": {"tx": {"lease": 3000}, "rx": {"max_message_size": 512 * 1024}},
            "shared_memory": {"enabled": False},
        },
    }
    return zenoh.Config.from_json5(json.dumps(config))


class Network:
    """All that a robot declares, asks and says."""

    def __init__(self, endpoint: str, colony: str, arena: str, robot: bytes) -> None:
        self.inputs: Queue[Input] = Queue(MOST_WAITING)
        self.dropped = 0
        """Inputs that found the queue full"""
        self.arena = f"crcolony/1/arena/{arena}"
        self.colony = f"crcolony/1/colony/{colony}"
        self.robot = robot.hex()
        self.session = zenoh.open(zenoh_config(endpoint))
        self.name = str(self.session.zid())
        observer = f"crcolony/1/observer/{self.name}"
        self._declared: list[Any] = [self.session.liveliness().declare_token(observer)]

    def declare(self, incarnation: int) -> None:
        """The token last: who sees it can reach the robot."""
        session, live = self.session, self.session.liveliness()
        before = self._declared
        self._declared = [
            session.declare_subscriber(
                f"{self.colony}/inbox/{self.robot}",
                lambda s: self._put(EnvelopeArrived(_bytes(s.payload))),
            ),
            session.declare_subscriber(
                f"{self.arena}/body/{self.robot}/observation",
                lambda s: self._put(ObservationArrived(_bytes(s.payload))),
            ),
            session.declare_queryable(f"{self.colony}/history/{self.robot}", self._on_query),
            session.declare_queryable(f"{self.colony}/metadata/{self.robot}", self._on_query),
            live.declare_token(f"{self.colony}/alive/{self.robot}/{incarnation}/{self.name}"),
            live.declare_subscriber(f"{self.colony}/alive/*/*/*", self._on_robot, history=True),
            live.declare_subscriber(f"{self.arena}/alive/*/*", self._on_arena, history=True),
        ]
        for token in before:
            token.undeclare()

    def close(self) -> None:
        for entity in reversed(self._declared):
            entity.undeclare()
        self.session.close()  # type: ignore[no-untyped-call]

    def send_envelope(self, to: bytes, envelope: bytes) -> None:
        self._say(f"{self.colony}/inbox/{to.hex()}", envelope)

    def send_action(self, action: bytes) -> None:
        self._say(f"{self.arena}/body/{self.robot}/action", action)

    def publish(self, topic: str, message: bytes) -> None:
        self._say(f"{self.colony}/{topic}/{self.robot}", message)

    def request_body(self, request: bytes) -> None:
        self.ask(f"{self.arena}/body/{self.robot}/join", request, BodyReply)

    def ask_for_metadata(self) -> None:
        """Of every robot of the colony."""
        self.ask(f"{self.colony}/metadata/*", None, MetadataReply)

    def ask(self, key: str, payload: bytes | None, kind: Callable[[bytes], Input]) -> None:
        def on_reply(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                self._put(kind(_bytes(reply.ok.payload)))

        self.session.get(
            key,
            on_reply,
            payload=payload,
            timeout=JOIN_TIMEOUT_S,
            consolidation=zenoh.ConsolidationMode.NONE,
        )

    def _say(self, key: str, payload: bytes) -> None:
        """Dropped where a link is congested, so that a frozen peer blocks no other."""
        self.session.put(
            key, payload, congestion_control=zenoh.CongestionControl.DROP, express=True
        )

    def _put(self, arrived: Input) -> None:
        try:
            self.inputs.put_nowait(arrived)
        except Full:
            self.dropped += 1

    def get(self, timeout_s: float) -> Input | None:
        try:
            return self.inputs.get(timeout=timeout_s)
        except Empty:
            return None

    def _on_query(self, query: zenoh.Query) -> None:
        topic = str(query.key_expr).split("/")[4]
        payload = b"" if query.payload is None else _bytes(query.payload)
        once = threading.Lock()

        def reply(message: bytes) -> None:
            if once.acquire(blocking=False):
                query.reply(f"{self.colony}/{topic}/{self.robot}", message)
                query.drop()  # type: ignore[no-untyped-call]

        self._put(Question(topic, payload, reply))

    def _on_robot(self, sample: zenoh.Sample) -> None:
        *_, robot, incarnation, session = str(sample.key_expr).split("/")
        is_online = sample.kind == zenoh.SampleKind.PUT
        with contextlib.suppress(ValueError):  # anybody may declare a token
            self._put(PeerToken(bytes.fromhex(robot), int(incarnation), session, is_online))

    def _on_arena(self, sample: zenoh.Sample) -> None:
        *_, arena_run, session = str(sample.key_expr).split("/")
        if arena_run.isdecimal():
            self._put(ArenaToken(int(arena_run), session, sample.kind == zenoh.SampleKind.PUT))


def _bytes(payload: zenoh.ZBytes) -> bytes:
    """What is too long for any message becomes empty, which is none."""
    return payload.to_bytes() if len(payload) <= ENVELOPE_BYTES else b""
