"""Samples of telemetry, raw and parsed: keys and payloads are read here and nowhere else."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, NamedTuple

import msgspec

from crcolony.protocol.codec import WireError
from crcolony.protocol.identity import RobotId
from crcolony.protocol.key_expressions import (
    ArenaToken,
    RobotToken,
    parse_arena_token,
    parse_arena_topic,
    parse_robot_token,
    parse_robot_topic,
)
from crcolony.protocol.telemetry_messages import (
    Activity,
    ArenaMetadata,
    EventMessage,
    RobotMetadata,
    RobotState,
    Scene,
    decode_activity,
    decode_arena_metadata,
    decode_event,
    decode_history_reply,
    decode_scene,
    decode_state,
)
from crcolony.telemetry.older_messages import decode_metadata_of_any_age

SampleKind = Literal[
    "online", "offline", "state", "event", "activity", "scene", "history", "metadata"
]


class RawSample(NamedTuple):
    """A sample as it arrived, and when."""

    kind: SampleKind
    """`online` and `offline` are liveliness tokens, without a payload; `history` and `metadata` are replies."""
    key: str
    payload: bytes
    unix_ms: int


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sample:
    unix_ms: int
    """When it arrived"""
    size_bytes: int
    """Of the payload"""

    @property
    def unix_s(self) -> float:
        """When it arrived."""
        return self.unix_ms / 1000.0


@dataclass(frozen=True, slots=True, kw_only=True)
class OnlineSample(_Sample):
    """A liveliness token was declared."""

    kind: ClassVar[SampleKind] = "online"
    token: RobotToken | ArenaToken


@dataclass(frozen=True, slots=True, kw_only=True)
class OfflineSample(_Sample):
    """A liveliness token was undeclared, or its session was lost."""

    kind: ClassVar[SampleKind] = "offline"
    token: RobotToken | ArenaToken


@dataclass(frozen=True, slots=True, kw_only=True)
class StateSample(_Sample):
    """A robot published its state."""

    kind: ClassVar[SampleKind] = "state"
    colony: str
    state: RobotState


@dataclass(frozen=True, slots=True, kw_only=True)
class EventSample(_Sample):
    """A robot published an event."""

    kind: ClassVar[SampleKind] = "event"
    colony: str
    message: EventMessage


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotActivitySample(_Sample):
    """A robot published what it does while it has no body."""

    kind: ClassVar[SampleKind] = "activity"
    colony: str
    robot: RobotId
    activity: Activity


@dataclass(frozen=True, slots=True, kw_only=True)
class ArenaActivitySample(_Sample):
    """An arena published what it does before its run begins."""

    kind: ClassVar[SampleKind] = "activity"
    arena: str
    activity: Activity


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneSample(_Sample):
    """An arena published its scene."""

    kind: ClassVar[SampleKind] = "scene"
    scene: Scene


@dataclass(frozen=True, slots=True, kw_only=True)
class HistorySample(_Sample):
    """A robot replied to a request for missed events."""

    kind: ClassVar[SampleKind] = "history"
    colony: str
    robot: RobotId
    incarnation: int
    oldest: int
    """Sequence number of the oldest event that the robot still keeps"""
    messages: Sequence[EventMessage]
    malformed: int
    """Events in the reply that could not be parsed"""

    @property
    def is_empty(self) -> bool:
        """Whether the reply holds no event at all."""
        return not self.messages and not self.malformed


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotMetadataSample(_Sample):
    """A robot replied to a request for its metadata."""

    kind: ClassVar[SampleKind] = "metadata"
    colony: str
    metadata: RobotMetadata


@dataclass(frozen=True, slots=True, kw_only=True)
class ArenaMetadataSample(_Sample):
    """An arena replied to a request for its metadata."""

    kind: ClassVar[SampleKind] = "metadata"
    metadata: ArenaMetadata


@dataclass(frozen=True, slots=True, kw_only=True)
class MalformedSample(_Sample):
    """Something arrived that is no telemetry."""

    kind: SampleKind
    """What it would be by its key expression"""
    reason: str


TelemetrySample = (
    OnlineSample
    | OfflineSample
    | StateSample
    | EventSample
    | RobotActivitySample
    | ArenaActivitySample
    | SceneSample
    | HistorySample
    | RobotMetadataSample
    | ArenaMetadataSample
    | MalformedSample
)

_settings = msgspec.json.Decoder(dict[str, dict[str, Any]])


def parse_sample(raw: RawSample) -> TelemetrySample:
    """Return what a raw sample means; a `MalformedSample` if key or payload are invalid or contradict each other."""
    try:
        return _parse(raw)
    except WireError as error:
        return MalformedSample(kind=raw.kind, reason=str(error), **_common(raw))


def _common(raw: RawSample) -> dict[str, int]:
    return {"unix_ms": raw.unix_ms, "size_bytes": len(raw.payload)}


def _parse(raw: RawSample) -> TelemetrySample:
    """Return what a raw sample means; raises WireError."""
    match raw.kind:
        case "online":
            return OnlineSample(token=_token(raw.key), **_common(raw))
        case "offline":
            return OfflineSample(token=_token(raw.key), **_common(raw))
        case "state":
            colony, robot = _robot(raw)
            state = decode_state(raw.payload)
            _require(state.robot == robot)
            return StateSample(colony=colony, state=state, **_common(raw))
        case "event":
            colony, robot = _robot(raw)
            message = _event(robot, raw.payload)
            return EventSample(colony=colony, message=message, **_common(raw))
        case "activity":
            return _activity(raw)
        case "scene":
            scene = decode_scene(raw.payload)
            _require(scene.arena == parse_arena_topic(raw.key, "scene"))
            return SceneSample(scene=scene, **_common(raw))
        case "history":
            return _history(raw)
        case "metadata":
            return _metadata(raw)


def _token(key: str) -> RobotToken | ArenaToken:
    token = parse_robot_token(key) or parse_arena_token(key)
    if token is None:
        raise WireError("the key is no liveliness token")
    return token


def _robot(raw: RawSample) -> tuple[str, RobotId]:
    named = parse_robot_topic(raw.key, raw.kind)
    if named is None:
        raise WireError("the key names no robot")
    return named


def _event(robot: RobotId, payload: bytes) -> EventMessage:
    message = decode_event(payload)
    _require(message.robot == robot and message.seq > 0)
    return message


def _activity(raw: RawSample) -> RobotActivitySample | ArenaActivitySample:
    activity = decode_activity(raw.payload)
    arena = parse_arena_topic(raw.key, "activity")
    if arena is not None:
        return ArenaActivitySample(arena=arena, activity=activity, **_common(raw))
    colony, robot = _robot(raw)
    return RobotActivitySample(colony=colony, robot=robot, activity=activity, **_common(raw))


def _history(raw: RawSample) -> HistorySample:
    """Return a reply with all of its events that are well formed."""
    colony, robot = _robot(raw)
    reply = decode_history_reply(raw.payload)
    messages, malformed = [], 0
    for payload in reply.events:
        try:
            messages.append(_event(robot, payload))
        except WireError:
            malformed += 1
    return HistorySample(
        colony=colony,
        robot=robot,
        incarnation=reply.incarnation,
        oldest=reply.oldest,
        messages=messages,
        malformed=malformed,
        **_common(raw),
    )


def _metadata(raw: RawSample) -> RobotMetadataSample | ArenaMetadataSample:
    arena = parse_arena_topic(raw.key, "metadata")
    if arena is not None:
        of_arena = decode_arena_metadata(raw.payload)
        _require(of_arena.arena == arena and _is_settings(of_arena.settings))
        return ArenaMetadataSample(metadata=of_arena, **_common(raw))
    colony, robot = _robot(raw)
    of_robot = decode_metadata_of_any_age(raw.payload)
    _require(of_robot.robot == robot and _is_settings(of_robot.settings))
    return RobotMetadataSample(colony=colony, metadata=of_robot, **_common(raw))


def _require(is_valid: bool) -> None:
    if not is_valid:
        raise WireError("the payload contradicts its key")


def _is_settings(text: str) -> bool:
    """Return whether this is a JSON object of objects."""
    try:
        _settings.decode(text)
    except (msgspec.DecodeError, RecursionError):
        return False
    return True
