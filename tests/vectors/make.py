"""Makes the golden vectors: one file for every kind of message, the same bytes on every run.

`python -m tests.vectors.make` writes them beside this file. Only a new protocol version may change one.
"""

from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from crcolony.body.contract import ACTION_WIDTH, OBSERVATION_WIDTH
from crcolony.evolution.history import Born, Died, Lived, TurnedOver
from crcolony.protocol.body_messages import (
    Action,
    BodyDenied,
    BodyGranted,
    Contact,
    Join,
    Leave,
    LocalLink,
    Observation,
    pack_row,
)
from crcolony.protocol.body_requests import (
    PendingRequest,
    keys_of_grant,
    open_request,
    sign_reply,
)
from crcolony.protocol.codec import Message, encode
from crcolony.protocol.envelope import sign_message
from crcolony.protocol.identity import seeded
from crcolony.protocol.link_keys import ExchangeKey, seal
from crcolony.protocol.mating_messages import (
    BY_INITIATOR,
    Abort,
    Accept,
    Commit,
    Done,
    Encounter,
    MatingMessage,
    Propose,
    Refuse,
    pack_genes,
)
from crcolony.protocol.roster import Member, Roster, decode_signed_roster, sign_roster
from crcolony.protocol.roster_gossip import RosterSerial
from crcolony.protocol.signed_telemetry import (
    purpose_of_arena,
    purpose_of_robot,
    sign_telemetry,
)
from crcolony.protocol.stop_messages import Clear, Stop, StopAddress, StoppedRobot, StopReply
from crcolony.protocol.telemetry_messages import (
    Activity,
    ArenaMetadata,
    EncounterOutcome,
    EventMessage,
    Exchanged,
    Fault,
    HistoryReply,
    HistoryRequest,
    Met,
    RobotEvent,
    RobotMetadata,
    RobotState,
    Scene,
    ScenePack,
    SceneRobot,
)

FOLDER = Path(__file__).parent
COLONY = "vectors"

INITIATOR, RESPONDER = sorted((seeded(COLONY, 1, k) for k in range(2)), key=lambda key: key.id)
ENCOUNTER = Encounter(INITIATOR.id, RESPONDER.id, incarnation=3, count=300)
NONCE = 0x1234_5678_9ABC
SCHEMA = bytes(range(16))
INITIATOR_GENES = np.array([0.0, 1.5, -2.25, 1.0 / 3.0, 5e-324])
RESPONDER_GENES = np.array([-0.0, 0.999, 1e300, -1e-9, 2.0])

MATING_MESSAGES: dict[str, MatingMessage] = {
    "propose": Propose(ENCOUNTER, NONCE, SCHEMA, "agent-17", pack_genes(INITIATOR_GENES)),
    "accept": Accept(ENCOUNTER, NONCE, SCHEMA, "Ähnlich 3", pack_genes(RESPONDER_GENES)),
    "refuse": Refuse(ENCOUNTER, "busy"),
    "commit": Commit(ENCOUNTER),
    "abort": Abort(ENCOUNTER),
    "done": Done(ENCOUNTER),
}
"""The content of each signed envelope."""

EXCHANGE = ExchangeKey(bytes(range(32)))
JOIN = Join(INITIATOR.id, COLONY, -1, 2**61, 3, 300, EXCHANGE.public)
GRANTED = BodyGranted(
    request=bytes(range(16)),
    exchange_key=EXCHANGE.public,
    slot=2,
    arena_run=2**61,
    tick=70_000,
    period_s=0.2,
    lockstep=False,
    body='{"camera_m":1.5}',
)

BODIES: dict[str, Message] = {
    "join": JOIN,
    "body_granted": GRANTED,
    "body_denied": BodyDenied(bytes(range(16)), "every slot is taken"),
    "leave": Leave(INITIATOR.id, 2**61, 3, 301),
    "observation": Observation(
        arena_run=2**61,
        tick=70_000,
        row=pack_row(np.arange(OBSERVATION_WIDTH) / 8.0 - 2.0),
        contact=Contact(RESPONDER.id, NONCE),
    ),
    "observation_alone": Observation(
        arena_run=0, tick=0, row=pack_row(np.zeros(OBSERVATION_WIDTH)), contact=None
    ),
    "action": Action(70_000, pack_row(np.arange(ACTION_WIDTH) / 32.0)),
    "local_link": LocalLink(INITIATOR.id, 2**61, bytes(range(16))),
}
"""Messages between a robot and its body."""

ARENA = "lab"
ARENA_IDENTITY = seeded(COLONY, 1, 2)
ARENA_EXCHANGE = ExchangeKey(bytes(range(32, 64)))
_PENDING = PendingRequest(JOIN, ARENA, INITIATOR, EXCHANGE)
_REQUEST = open_request(_PENDING.data)
_GRANTED = msgspec.structs.replace(
    GRANTED, request=_REQUEST.digest, exchange_key=ARENA_EXCHANGE.public
)
LINK_KEYS = keys_of_grant(ARENA_EXCHANGE, _REQUEST, _GRANTED)

LINK: dict[str, bytes] = {
    "link_request.bytes": _PENDING.data,
    "link_reply.bytes": sign_reply(_GRANTED, ARENA, ARENA_IDENTITY),
    "link_observation.bytes": seal(LINK_KEYS.observations, encode(BODIES["observation"])),
    "link_action.bytes": seal(LINK_KEYS.actions, encode(BODIES["action"])),
    "link_local_robot.bytes": seal(LINK_KEYS.actions, encode(BODIES["local_link"])),
    "link_local_body.bytes": seal(LINK_KEYS.observations, encode(BODIES["local_link"])),
}
"""One link from the request to the first messages, as it travels; bodies of the arena `lab`."""

AGENT, OTHER = f"{INITIATOR.id.hex()}/17", f"{RESPONDER.id.hex()}/3"

EVENTS: dict[str, RobotEvent] = {
    "met": Met(70_000, RESPONDER.id, AGENT),
    "encounter_outcome": EncounterOutcome(70_001, "refused", RESPONDER.id, ENCOUNTER, "busy"),
    "exchanged": Exchanged(70_000, ENCOUNTER, AGENT, OTHER, 0.75, True, False),
    "born": Born(0, 2, 0, AGENT, "00ff", pack_genes(INITIATOR_GENES), None, OTHER),
    "died": Died(9, 2, AGENT),
    "lived": Lived(9, 2, 0, AGENT, 1200, 0.5, 3, 1),
    "turned_over": TurnedOver(9, 2, 1, 7),
    "fault": Fault(9, "the arena is gone"),
}
"""The events of a robot; each travels in an `event` message."""

EVENT_MESSAGES = {
    f"event_{name}": EventMessage(INITIATOR.id, 3, seq, 1_790_000_000_000, event)
    for seq, (name, event) in enumerate(EVENTS.items(), 1)
}

TELEMETRY: dict[str, Message] = {
    **EVENT_MESSAGES,
    "state": RobotState(
        robot=INITIATOR.id,
        number=2,
        arena="",
        incarnation=3,
        seq=8,
        unix_ms=1_790_000_000_000,
        tick=70_000,
        generation=1,
        agent=AGENT,
        energy=0.25,
        module=-1,
        matings=4,
        conceptions=3,
        captures=70,
        pool=2,
        waiting=2,
        doubts=1,
        orphaned=1,
        peers=3,
        refused=300,
        dropped=0,
        faults=5,
        period_ms=200.5,
    ),
    "activity": Activity(1_790_000_000_000, "compiling the control step", 12, 30),
    "history_request": HistoryRequest(3, 2),
    "history_reply": HistoryReply(3, 1, [encode(EVENT_MESSAGES["event_met"])]),
    "robot_metadata": RobotMetadata(
        INITIATOR.id,
        3,
        '{"body":{"camera_m":1.5}}',
        [RESPONDER.id],
        "weight -inf inf\nrate 0.0 1.0",
    ),
    "arena_metadata": ArenaMetadata("lab", 2**61, '{"arena":{"packs":8}}'),
    "scene": Scene(
        arena="lab",
        arena_run=2**61,
        seq=12,
        tick=70_000,
        unix_ms=1_790_000_000_000,
        period_s=0.2,
        width_m=2.5,
        height_m=2.0,
        robots=[SceneRobot(INITIATOR.id, COLONY, 0.5, -0.25, 3.0, True, 1.0, 0.0, 0.0, False)],
        packs=[ScenePack(-1.0, 0.5, 0.0, 1.0, 0.0, 0.4)],
    ),
}
"""Messages to observers, and their queries."""

SIGNED_TELEMETRY = {
    "telemetry_state.bytes": sign_telemetry(
        encode(TELEMETRY["state"]), purpose_of_robot(COLONY), INITIATOR, 3 * 2**32 + 7
    ),
    "telemetry_scene.bytes": sign_telemetry(
        encode(TELEMETRY["scene"]), purpose_of_arena("lab"), ARENA_IDENTITY
    ),
}
"""A state and a scene as they travel."""

STOPS: dict[str, Message] = {
    "stop": Stop(bytes(range(16))),
    "clear": Clear(123_456),
    "stop_reply": StopReply(
        StopAddress("lab", "a1b2"),
        123_456,
        [
            StoppedRobot("firmware@/dev/ttyACM0", 1, True, ""),
            StoppedRobot("aseba@/dev/ttyACM1", 1, False, "lost: silent for 0.5 s"),
        ],
        [StopAddress("arena", "c3")],
    ),
}
"""The emergency stop."""

ROSTER = Roster(
    COLONY,
    300,
    (
        Member("robot", "kitchen", (INITIATOR.id,)),
        Member("robot", "lost", (RESPONDER.id,), is_revoked=True),
        Member("bridge", "desk", arenas=("lab",)),
    ),
)
DEPLOYMENTS: dict[str, msgspec.Struct] = {
    "roster": decode_signed_roster(sign_roster(ROSTER, INITIATOR)),
    "roster_serial": RosterSerial(300),
}
"""What the members of a deployment pass on; the authority has the initiator's key here."""


def make() -> dict[str, bytes]:
    """Return the bytes of every vector by the name of its file."""
    vectors = {}
    for name, content in MATING_MESSAGES.items():
        sender = INITIATOR if isinstance(content, BY_INITIATOR) else RESPONDER
        vectors[f"{name}.msgpack"] = sign_message(content, COLONY, sender)
    for name, message in {**BODIES, **TELEMETRY, **STOPS, **DEPLOYMENTS}.items():
        vectors[f"{name}.msgpack"] = encode(message)
    return vectors | LINK | SIGNED_TELEMETRY


def plain(value: Any) -> Any:
    """Return a message as lists and plain values, as a MessagePack library reads it."""
    if isinstance(value, msgspec.Struct):
        tag = value.__struct_config__.tag
        fields = [plain(getattr(value, name)) for name in value.__struct_fields__]
        return fields if tag is None else [tag, *fields]
    return [plain(item) for item in value] if isinstance(value, list | tuple) else value


if __name__ == "__main__":
    for name, data in make().items():
        (FOLDER / name).write_bytes(data)
