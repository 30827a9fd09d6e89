"""The tables of an export: which there are, and how what was heard becomes a row of one.

Columns follow from the messages of `colony/telemetry.py`: their fields, flat, ids as hex digits. Names end in units.
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
"""Name and type of every column"""
Row = tuple[Any, ...]

GENES = "genes"
"""Of a birth, in the order of its robot's schema"""
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
"""A robot's number in its colony; `robot` is its id"""


def _columns(kind: Any, renamed: Mapping[str, str] | None = None) -> Iterator[tuple[str, str]]:
    """Yield the columns of a message's fields, but for lists."""
    info = inspect.type_info(kind)
    assert isinstance(info, inspect.StructType)
    for field in info.fields:
        type_ = field.type
        if isinstance(type_, inspect.UnionType):  # with None
            type_ = next(one for one in type_.types if not isinstance(one, inspect.NoneType))
        if isinstance(type_, inspect.StructType):
            yield from _columns(type_.cls, _OF_ENCOUNTERS)
        elif field.name == GENES:
            yield GENES, "list<double>"
        elif not isinstance(type_, inspect.ListType):
            yield (renamed or {}).get(field.name, field.name), _TYPES[type(type_)]


def _values(message: msgspec.Struct) -> Iterator[Any]:
    """Yield what stands in the columns of a message."""
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
    """Return the genes of a birth, or None if they are none."""
    return np.frombuffer(genes, dtype="<f8").tolist() if len(genes) % 8 == 0 else None


_HEARD = {"heard_unix_ms": "int64"}
_TELLER = {
    **_HEARD,
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
"""Which table holds which events; of a mating each of the two robots tells its side"""

TABLES: dict[str, Columns] = {
    "states": {**_HEARD, "colony": "string", **dict(_columns(RobotState))},
    **{name: {**_TELLER, **dict(_columns(kind, _OF_EVENTS))} for kind, name in EVENTS.items()},
    "poses": {**_HEARD, **dict(_columns(Scene)), **dict(_columns(SceneRobot))},
    "packs": {**_HEARD, **dict(_columns(Scene)), "pack": "int64", **dict(_columns(ScenePack))},
}


def state_row(state: RobotState, colony: str, heard_unix_ms: int) -> Row:
    """Return a row of `states`."""
    return (heard_unix_ms, colony, *_values(state))


def event_row(message: EventMessage, colony: str, heard_unix_ms: int) -> Row:
    """Return a row of the event's table."""
    head = (message.robot.hex(), message.incarnation, message.seq, message.unix_ms)
    return (heard_unix_ms, colony, *head, *_values(message.event))


def pose_rows(scene: Scene, heard_unix_ms: int) -> Iterator[Row]:
    """Yield rows of `poses`: every robot of a scene."""
    head = (heard_unix_ms, *_values(scene))
    for robot in scene.robots:
        yield (*head, *_values(robot))


def pack_rows(scene: Scene, heard_unix_ms: int) -> Iterator[Row]:
    """Yield rows of `packs`: every battery pack of a scene."""
    head = (heard_unix_ms, *_values(scene))
    for number, pack in enumerate(scene.packs):
        yield (*head, number, *_values(pack))
