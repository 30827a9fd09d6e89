"""What a robot and an arena tell whoever watches: a state at a fixed rate, and every event with a number.

Telemetry may be lost. Events of one life of a robot are numbered without gaps, and a state names the last of them, so
an observer knows what it missed and can ask for it: `HistoryReply` answers from the robot's ring of recent events.
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
"""A robot that has said nothing for so long is silent; its state comes several times as often."""

MAX_HISTORY_EVENTS = 64
"""Events in one answer, at most."""
MAX_REPORTED_PEERS = 1000
"""Of the robots that one sees, it names so many."""
MAX_ROBOT_SETTINGS, MAX_ARENA_SETTINGS = 8_192, 32_768
"""Characters of the settings that one tells of itself; an arena's obstacles may be many."""

MAX_SCENE_ITEMS = 4_096
"""Robots, and packs, in one scene."""

Share = Annotated[float, Meta(ge=0.0, le=1.0)]
Metres = Annotated[float, Meta(ge=-1e6, le=1e6)]
"""From the arena's middle; what is no number is not within"""
Size = Annotated[float, Meta(gt=0.0, le=1e6)]
Count = Annotated[int, Meta(ge=0, lt=2**53)]
UnixMs = Annotated[int, Meta(ge=0, lt=2**53)]


class Met(Message, frozen=True, tag="Met"):
    """The own body reported a contact."""

    tick: Tick
    peer: Id
    agent: AgentName


class Exchanged(Message, frozen=True, tag="Exchanged"):
    """A mating took place, as one of the two sees it: what it made of the partner's genotype."""

    tick: Tick
    encounter: Encounter
    agent: AgentName
    partner: AgentName
    energy: Share
    conceived: bool
    too_late: bool


class EncounterOutcome(Message, frozen=True, tag="EncounterOutcome"):
    """Something became of an encounter."""

    tick: Tick
    outcome: Outcome
    peer: Id
    encounter: Encounter | None
    reason: Annotated[str, Meta(max_length=200)]


class Fault(Message, frozen=True, tag="Fault"):
    """Something outside went wrong; the robot goes on."""

    tick: Tick
    what: Annotated[str, Meta(max_length=500)]


RobotEvent = Born | Died | Lived | TurnedOver | Met | Exchanged | EncounterOutcome | Fault


class EventMessage(Message, frozen=True, tag="event"):
    """One event of a robot; `seq` counts from 1 in every life."""

    robot: Id
    incarnation: Ordinal
    seq: Count
    unix_ms: UnixMs
    event: RobotEvent


class RobotState(Message, frozen=True, tag="state"):
    """How a robot is, a few times a second."""

    robot: Id
    number: Annotated[int, Meta(ge=0, lt=2**31)]
    arena: Annotated[str, Meta(pattern=r"^[A-Za-z0-9_.-]{0,64}\Z")]
    """Where its body is; empty: it has none"""
    incarnation: Ordinal
    seq: Count
    """Its last event"""
    unix_ms: UnixMs
    tick: Tick
    generation: Count
    agent: Annotated[str, Meta(max_length=64)]
    energy: Share
    module: Annotated[int, Meta(ge=-1, lt=100)]
    matings: Count
    """In all its lives"""
    conceptions: Count
    captures: Count
    """Batteries that its agents have captured, in all its lives"""
    pool: Count
    """Offspring that wait for the next generation"""
    waiting: Count
    """Encounters that wait for the partner"""
    doubts: Count
    orphaned: Count
    peers: Count
    """Robots it sees on the network"""
    refused: Count
    """Letters and messages that were not what they should be"""
    dropped: Count
    """Of what came in, lost because it was too much"""
    faults: Count
    period_ms: Annotated[float, Meta(ge=0.0, le=1e9)]
    """Between its last two observations"""


class HistoryRequest(Message, frozen=True, tag="history_request"):
    """An observer asks for the events of a life from one number on."""

    incarnation: Ordinal
    first: Count


class HistoryReply(Message, frozen=True, tag="history_reply"):
    """The answer: encoded `EventMessage` in order, as many as are kept and fit; `oldest` is the first number still kept."""

    incarnation: Ordinal
    oldest: Count
    events: Annotated[list[bytes], Meta(max_length=MAX_HISTORY_EVENTS)]


class RobotMetadata(Message, frozen=True, tag="robot_metadata"):
    """What a robot answers whoever asks about it: what seldom changes."""

    robot: Id
    incarnation: Ordinal
    settings: Annotated[str, Meta(max_length=MAX_ROBOT_SETTINGS)]
    """A JSON object of the groups body (the one it has, as its arena told), learning, life and heredity"""
    peers: Annotated[list[Id], Meta(max_length=MAX_REPORTED_PEERS)]
    """Whom it sees on the network now"""


class ArenaMetadata(Message, frozen=True, tag="arena_metadata"):
    """What an arena answers whoever asks about it."""

    arena: Name
    arena_run: ArenaRun
    settings: Annotated[str, Meta(max_length=MAX_ARENA_SETTINGS)]
    """A JSON object of the groups arena and body"""


class SceneRobot(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """A body in the arena."""

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
    """A battery pack."""

    x_m: Metres
    y_m: Metres
    red: Share
    green: Share
    blue: Share
    charge: Share


class Scene(Message, frozen=True, tag="scene"):
    """The arena as it is, a few times a second. `seq` counts the scenes of this run of the arena."""

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
