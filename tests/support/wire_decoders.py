"""The decoders for received bytes, and the golden vectors that each of them reads."""

from collections.abc import Callable
from typing import Any

from crcolony.protocol.body_messages import (
    decode_action,
    decode_join,
    decode_join_reply,
    decode_local_link,
    decode_observation,
)
from crcolony.protocol.envelope import open_envelope
from crcolony.protocol.mating_messages import decode_mating_message
from crcolony.protocol.roster import decode_signed_roster
from crcolony.protocol.roster_gossip import decode_roster_serial
from crcolony.protocol.stop_messages import decode_stop, decode_stop_reply
from crcolony.protocol.telemetry_messages import (
    decode_activity,
    decode_arena_metadata,
    decode_event,
    decode_history_reply,
    decode_history_request,
    decode_robot_metadata,
    decode_scene,
    decode_state,
)
from tests.vectors.make import EVENT_MESSAGES, FOLDER, MATING_MESSAGES

Decode = Callable[[bytes], Any]

DECODERS: dict[str, Decode] = {
    "envelope": lambda data: open_envelope(data)[0],
    "mating": decode_mating_message,
    "join": decode_join,
    "join_reply": decode_join_reply,
    "observation": decode_observation,
    "action": decode_action,
    "local_link": decode_local_link,
}
"""Decoders between robots, and between a robot and its body."""

TELEMETRY_DECODERS: dict[str, Decode] = {
    "event": decode_event,
    "state": decode_state,
    "activity": decode_activity,
    "history_request": decode_history_request,
    "history_reply": decode_history_reply,
    "robot_metadata": decode_robot_metadata,
    "arena_metadata": decode_arena_metadata,
    "scene": decode_scene,
    "stop": decode_stop,
    "stop_reply": decode_stop_reply,
    "roster": decode_signed_roster,
    "roster_serial": decode_roster_serial,
}
"""Decoders of observers, of queries to robots, of the emergency stop, and of deployments."""

DECODER_OF = {
    **dict.fromkeys(MATING_MESSAGES, "envelope"),
    "join": "join",
    "leave": "join",
    "body_granted": "join_reply",
    "body_denied": "join_reply",
    "observation": "observation",
    "observation_alone": "observation",
    "action": "action",
    "local_link": "local_link",
}
"""By vector between robots, or a robot and its body, the name of its decoder."""

TELEMETRY_DECODER_OF = {
    **dict.fromkeys(EVENT_MESSAGES, "event"),
    **{name: name for name in TELEMETRY_DECODERS if name != "event"},
    "clear": "stop",
}
"""By vector of telemetry, and of the emergency stop, the name of its decoder."""

VECTORS = {
    name: (FOLDER / f"{name}.msgpack").read_bytes() for name in (*DECODER_OF, *TELEMETRY_DECODER_OF)
}
