"""The tables of an export, and the rows of samples in them.

Columns are the fields of the messages in `protocol/telemetry_messages.py`, flattened, with ids as hex digits.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import msgspec
import numpy as np
from msgspec import inspect

from crcolony.evolution.history import Born, Died, Lived, TurnedOver
from crcolony.protocol.mating_messages import Encounter
from crcolony.protocol.telemetry_messages import (
    EncounterOutcome,
    EventMessage,
    Exchanged,
    Fault,
    Met,
    RobotState,
    Scene,
    ScenePack,
    SceneRobot,
)

Columns = Mapping[str, str]
"""Name and type of every column."""
Row = tuple[Any, ...]

GENES = "genes"
"""The column with the genes of a birth, in the order of its robot's schema."""
_TYPES: dict[type, str] = {
    inspect.BoolType: "bool",
    inspect.IntType: "int64",
    inspect.FloatType: "double",
    inspect.StrType: "string",
    inspect.LiteralType: "string",
    inspect.BytesType: "string",
}
_OF_ENCOUNTERS = {"incarnation": "encounter_incarnation", "count": "encounter_count"}
_NO_ENCOUNTER = (None,) * len(Encounter.__struct_fields__)
_OF_EVENTS = {"robot": "number"}
"""In events `robot` is the robot's number in its colony; in tables `robot` is its id."""


def _columns(kind: Any, renamed: Mapping[str, str] | None = None) -> Iterator[tuple[str, str]]:
    """Yield the columns of a message: its fields without lists."""
    info = inspect.type_info(kind)
    assert isinstance(info, inspect.StructType)
    for field in info.fields:
        type_ = field.type
        if isinstance(type_, inspect.UnionType):  # a type or None
            type_ = next(one for one in type_.types if not isinstance(one, inspect.NoneType))
        if isinstance(type_, inspect.StructType):
            yield from _columns(type_.cls, _OF_ENCOUNTERS)
        elif field.name == GENES:
            yield GENES, "list<double>"
        elif not isinstance(type_, inspect.ListType):
            yield (renamed or {}).get(field.name, field.name), _TYPES[type(type_)]


def _values(message: msgspec.Struct) -> Iterator[Any]:
    """Yield the values in the columns of a message."""
    for name in message.__struct_fields__:
        value = getattr(message, name)
        if name == GENES:
            yield floats_in(value)
        elif name == "encounter":
            yield from _values(value) if value is not None else _NO_ENCOUNTER
        elif isinstance(value, bytes):
            yield value.hex()
        elif not isinstance(value, list):
            yield value


def floats_in(genes: bytes) -> list[float] | None:
    """Return the genes of a birth, or None if these bytes are no float64 values."""
    return np.frombuffer(genes, dtype="<f8").tolist() if len(genes) % 8 == 0 else None


_RECEIVED = {"received_unix_ms": "int64"}
_EVENT_HEAD = {
    **_RECEIVED,
    "colony": "string",
    "robot": "string",
    "incarnation": "int64",
    "seq": "int64",
    "unix_ms": "int64",
}
EVENTS: dict[type, str] = {
    Exchanged: "matings",
    Met: "meetings",
    Born: "births",
    Lived: "lives",
    Died: "deaths",
    TurnedOver: "turnovers",
    EncounterOutcome: "outcomes",
    Fault: "faults",
}
"""The table of every kind of event; of a mating each of the two robots publishes its side."""

TABLES: dict[str, Columns] = {
    "states": {**_RECEIVED, "colony": "string", **dict(_columns(RobotState))},
    **{name: {**_EVENT_HEAD, **dict(_columns(kind, _OF_EVENTS))} for kind, name in EVENTS.items()},
    "poses": {**_RECEIVED, **dict(_columns(Scene)), **dict(_columns(SceneRobot))},
    "packs": {**_RECEIVED, **dict(_columns(Scene)), "pack": "int64", **dict(_columns(ScenePack))},
}


def state_row(state: RobotState, colony: str, received_unix_ms: int) -> Row:
    """Return the row of `states`."""
    return (received_unix_ms, colony, *_values(state))


def event_row(message: EventMessage, colony: str, received_unix_ms: int) -> Row:
    """Return the row of the event's table."""
    head = (message.robot.hex(), message.incarnation, message.seq, message.unix_ms)
    return (received_unix_ms, colony, *head, *_values(message.event))


def pose_rows(scene: Scene, received_unix_ms: int) -> Iterator[Row]:
    """Yield the rows of `poses`: one per robot of a scene."""
    head = (received_unix_ms, *_values(scene))
    for robot in scene.robots:
        yield (*head, *_values(robot))


def pack_rows(scene: Scene, received_unix_ms: int) -> Iterator[Row]:
    """Yield the rows of `packs`: one per battery pack of a scene."""
    head = (received_unix_ms, *_values(scene))
    for number, pack in enumerate(scene.packs):
        yield (*head, number, *_values(pack))
