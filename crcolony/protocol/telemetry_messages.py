"""The messages of robots and arenas to observers (PROTOCOL.md, "Telemetry").

Telemetry may be lost. The events of a robot's incarnation are numbered without gaps, and a state contains the last
number, so that an observer notices missed events and can request them.
"""

from typing import Annotated

import msgspec
from msgspec import Meta

from crcolony.evolution.history import Born, Died, Lived, TurnedOver
from crcolony.protocol.codec import (
    MAX_BODY_MESSAGE_BYTES,
    MAX_ENVELOPE_BYTES,
    MAX_SCENE_BYTES,
    ArenaRun,
    Id,
    Message,
    Name,
    Ordinal,
    StrictDecoder,
    Tick,
)
from crcolony.protocol.encounters import Outcome
from crcolony.protocol.mating_messages import AgentName, Encounter

SILENT_AFTER_S = 2.0
"""A robot without a state for so long is silent; states are published several times as often."""

MAX_HISTORY_EVENTS = 64
"""Events in one history reply."""
MAX_REPORTED_PEERS = 1000
"""Peers in the metadata of one robot."""
MAX_ROBOT_SETTINGS = 8_192
"""Characters of a robot's settings as JSON."""
MAX_SCHEMA = 32_768
"""Characters of a schema as text."""
MAX_ARENA_SETTINGS = 32_768
"""Characters of an arena's settings as JSON; it may have many obstacles."""

MAX_ACTIVITY_CHARACTERS = 400
"""Of what a robot or an arena does."""

MAX_SCENE_ITEMS = 4_096
"""Robots, and packs, in one scene."""

Share = Annotated[float, Meta(ge=0.0, le=1.0)]
Metres = Annotated[float, Meta(ge=-1e6, le=1e6)]
"""Coordinate from the arena's middle; NaN is not within the limits."""
Size = Annotated[float, Meta(gt=0.0, le=1e6)]
Count = Annotated[int, Meta(ge=0, lt=2**53)]
UnixMs = Annotated[int, Meta(ge=0, lt=2**53)]


class Met(Message, frozen=True, tag="Met"):
    """The robot's body reported a contact."""

    tick: Tick
    peer: Id
    agent: AgentName


class Exchanged(Message, frozen=True, tag="Exchanged"):
    """A mating took place; `conceived` says whether this robot got an offspring from it."""

    tick: Tick
    encounter: Encounter
    agent: AgentName
    partner: AgentName
    energy: Share
    conceived: bool
    too_late: bool


class EncounterOutcome(Message, frozen=True, tag="EncounterOutcome"):
    """The outcome of an encounter changed."""

    tick: Tick
    outcome: Outcome
    peer: Id
    encounter: Encounter | None
    reason: Annotated[str, Meta(max_length=200)]


class Fault(Message, frozen=True, tag="Fault"):
    """An external fault; the robot continues."""

    tick: Tick
    what: Annotated[str, Meta(max_length=500)]


RobotEvent = Born | Died | Lived | TurnedOver | Met | Exchanged | EncounterOutcome | Fault


class EventMessage(Message, frozen=True, tag="event"):
    """One event of a robot; `seq` counts from 1 in every incarnation."""

    robot: Id
    incarnation: Ordinal
    seq: Count
    unix_ms: UnixMs
    event: RobotEvent


class RobotState(Message, frozen=True, tag="state"):
    """State of a robot, published twice a second."""

    robot: Id
    number: Annotated[int, Meta(ge=0, lt=2**31)]
    arena: Annotated[str, Meta(pattern=r"^[A-Za-z0-9_.-]{0,64}\Z")]
    """The arena of its body; empty without a body"""
    incarnation: Ordinal
    seq: Count
    """Sequence number of its last event"""
    unix_ms: UnixMs
    tick: Tick
    generation: Count
    agent: Annotated[str, Meta(max_length=64)]
    energy: Share
    module: Annotated[int, Meta(ge=-1, lt=100)]
    matings: Count
    """In all incarnations"""
    conceptions: Count
    captures: Count
    """Batteries that its agents have captured, in all incarnations"""
    pool: Count
    """Offspring that wait for the next generation"""
    waiting: Count
    """Unresolved encounters"""
    doubts: Count
    orphaned: Count
    peers: Count
    """Robots whose token it sees"""
    refused: Count
    """Invalid inputs"""
    dropped: Count
    """Inputs lost because of their rate"""
    faults: Count
    period_ms: Annotated[float, Meta(ge=0.0, le=1e9)]
    """Between its last two observations"""


class Activity(Message, frozen=True, tag="activity"):
    """What a robot does before it has a body, or an arena before it has an arena run."""

    unix_ms: UnixMs
    doing: Annotated[str, Meta(max_length=MAX_ACTIVITY_CHARACTERS)]
    """For people: compiling the control step, waiting for arena lab"""
    done: Count
    """Parts of it that are done"""
    total: Count
    """Of how many; 0: unknown"""


class HistoryRequest(Message, frozen=True, tag="history_request"):
    """Request of an observer for the events of an incarnation from one number on."""

    incarnation: Ordinal
    first: Count


class HistoryReply(Message, frozen=True, tag="history_reply"):
    """Reply with encoded `EventMessage`s in order; `oldest` is the first number that is still kept."""

    incarnation: Ordinal
    oldest: Count
    events: Annotated[list[bytes], Meta(max_length=MAX_HISTORY_EVENTS)]


class RobotMetadata(Message, frozen=True, tag="robot_metadata"):
    """Reply of a robot with what seldom changes."""

    robot: Id
    incarnation: Ordinal
    settings: Annotated[str, Meta(max_length=MAX_ROBOT_SETTINGS)]
    """A JSON object of the groups body (the granted one), learning, life and heredity"""
    peers: Annotated[list[Id], Meta(max_length=MAX_REPORTED_PEERS)]
    """Robots whose token it sees"""
    schema: Annotated[str, Meta(max_length=MAX_SCHEMA)]
    """The text whose digest a mating quotes, a line a gene; empty if it is longer"""


class ArenaMetadata(Message, frozen=True, tag="arena_metadata"):
    """Reply of an arena with what seldom changes."""

    arena: Name
    arena_run: ArenaRun
    settings: Annotated[str, Meta(max_length=MAX_ARENA_SETTINGS)]
    """A JSON object of the groups arena and body"""


class SceneRobot(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """A robot's body in a scene."""

    robot: Id
    colony: Name
    x_m: Metres
    y_m: Metres
    heading_rad: Annotated[float, Meta(ge=-1e6, le=1e6)]
    beacon: bool
    red: Share
    green: Share
    blue: Share
    holds: bool


class ScenePack(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """A battery pack in a scene."""

    x_m: Metres
    y_m: Metres
    red: Share
    green: Share
    blue: Share
    charge: Share


class Scene(Message, frozen=True, tag="scene"):
    """Snapshot of the arena, published ten times a second. `seq` counts the scenes of this arena run."""

    arena: Name
    arena_run: ArenaRun
    seq: Count
    tick: Tick
    unix_ms: UnixMs
    period_s: Annotated[float, Meta(gt=0.0, le=1e4)]
    width_m: Size
    height_m: Size
    robots: Annotated[list[SceneRobot], Meta(max_length=MAX_SCENE_ITEMS)]
    packs: Annotated[list[ScenePack], Meta(max_length=MAX_SCENE_ITEMS)]


decode_event = StrictDecoder[EventMessage](EventMessage, MAX_ENVELOPE_BYTES).decode
decode_state = StrictDecoder[RobotState](RobotState, MAX_BODY_MESSAGE_BYTES).decode
decode_activity = StrictDecoder[Activity](Activity, MAX_BODY_MESSAGE_BYTES).decode
decode_history_request = StrictDecoder[HistoryRequest](
    HistoryRequest, MAX_BODY_MESSAGE_BYTES
).decode
decode_history_reply = StrictDecoder[HistoryReply](
    HistoryReply, 2 * MAX_ENVELOPE_BYTES, MAX_HISTORY_EVENTS
).decode
decode_robot_metadata = StrictDecoder[RobotMetadata](
    RobotMetadata, MAX_ENVELOPE_BYTES, MAX_REPORTED_PEERS
).decode
decode_arena_metadata = StrictDecoder[ArenaMetadata](ArenaMetadata, MAX_ENVELOPE_BYTES).decode
decode_scene = StrictDecoder[Scene](Scene, MAX_SCENE_BYTES, MAX_SCENE_ITEMS).decode
