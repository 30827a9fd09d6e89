"""What a robot and an arena tell whoever watches: a state at a fixed rate, and every event with a number.

Telemetry may be lost. Events of one life of a robot are numbered without gaps, and a state names the last of them, so
an observer knows what it missed and can ask for it: `Past` answers from the robot's ring of recent events.
"""

from typing import Annotated

import msgspec
from msgspec import Meta

from crcolony.evolution.history import Born, Died, Lived, TurnedOver
from crcolony.protocol.codec import (
    BODY_BYTES,
    LETTER_BYTES,
    SCENE_BYTES,
    Door,
    Id,
    Message,
    Name,
    Ordinal,
    Tick,
)
from crcolony.protocol.encounters import Outcome
from crcolony.protocol.mating_messages import AgentName, Encounter

STALE_S = 2.0
"""A robot that has said nothing for so long is silent; its state comes several times as often."""

PAST_EVENTS = 64
"""Events in one answer, at most."""
PEERS_TOLD = 1000
"""Of the robots that one sees, it names so many."""
ROBOT_SETTINGS, ARENA_SETTINGS = 8_192, 32_768
"""Characters of the settings that one tells of itself; an arena's obstacles may be many."""

Share = Annotated[float, Meta(ge=0.0, le=1.0)]
Metres = Annotated[float, Meta(ge=-1e6, le=1e6)]
"""From the arena's middle; what is no number is not within"""
Size = Annotated[float, Meta(gt=0.0, le=1e6)]
Count = Annotated[int, Meta(ge=0, lt=2**53)]
UnixMs = Annotated[int, Meta(ge=0, lt=2**53)]
World = Annotated[int, Meta(ge=0, lt=2**62)]


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


class Ended(Message, frozen=True, tag="Ended"):
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


RobotEvent = Born | Died | Lived | TurnedOver | Met | Exchanged | Ended | Fault


class Told(Message, frozen=True, tag="told"):
    """One event of a robot; `seq` counts from 1 in every life."""

    robot: Id
    life: Ordinal
    seq: Count
    unix_ms: UnixMs
    event: RobotEvent


class State(Message, frozen=True, tag="state"):
    """How a robot is, a few times a second."""

    robot: Id
    number: Annotated[int, Meta(ge=0, lt=2**31)]
    arena: Annotated[str, Meta(pattern=r"^[A-Za-z0-9_.-]{0,64}\Z")]
    """Where its body is; empty: it has none"""
    life: Ordinal
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


class Ask(Message, frozen=True, tag="ask"):
    """An observer asks for the events of a life from one number on."""

    life: Ordinal
    first: Count


class Past(Message, frozen=True, tag="past"):
    """The answer: encoded `Told` in order, as many as are kept and fit; `oldest` is the first number still kept."""

    life: Ordinal
    oldest: Count
    events: Annotated[list[bytes], Meta(max_length=PAST_EVENTS)]


class AboutRobot(Message, frozen=True, tag="about_robot"):
    """What a robot answers whoever asks about it: what seldom changes."""

    robot: Id
    life: Ordinal
    settings: Annotated[str, Meta(max_length=ROBOT_SETTINGS)]
    """A JSON object of the groups body (the one it has, as its arena told), learning, life and heredity"""
    peers: Annotated[list[Id], Meta(max_length=PEERS_TOLD)]
    """Whom it sees on the network now"""


class AboutArena(Message, frozen=True, tag="about_arena"):
    """What an arena answers whoever asks about it."""

    arena: Name
    world: World
    settings: Annotated[str, Meta(max_length=ARENA_SETTINGS)]
    """A JSON object of the groups arena and body"""


class SeenRobot(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
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


class SeenPack(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
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
    world: World
    seq: Count
    tick: Tick
    unix_ms: UnixMs
    period_s: Annotated[float, Meta(gt=0.0, le=1e4)]
    width_m: Size
    height_m: Size
    robots: Annotated[list[SeenRobot], Meta(max_length=4096)]
    packs: Annotated[list[SeenPack], Meta(max_length=4096)]


decode_told = Door[Told](Told, LETTER_BYTES).decode
decode_state = Door[State](State, BODY_BYTES).decode
decode_ask = Door[Ask](Ask, BODY_BYTES).decode
decode_past = Door[Past](Past, 2 * LETTER_BYTES).decode
decode_about_robot = Door[AboutRobot](AboutRobot, LETTER_BYTES).decode
decode_about_arena = Door[AboutArena](AboutArena, LETTER_BYTES).decode
decode_scene = Door[Scene](Scene, SCENE_BYTES).decode
