"""Observers read what robots tell, learn what they missed, and no telemetry makes them do anything but count it."""

import json
import random
from collections.abc import Callable
from typing import Any

import msgpack  # type: ignore[import-untyped]
import msgspec
import pytest

from crcolony.body.settings import CyberRodent
from crcolony.config import load
from crcolony.nodes.event_buffer import EventBuffer
from crcolony.nodes.reported_settings import settings_as_json, settings_of_robot
from crcolony.protocol.codec import Message, WireError, encode
from crcolony.protocol.telemetry_messages import (
    MAX_HISTORY_EVENTS,
    MAX_ROBOT_SETTINGS,
    EventMessage,
    Fault,
    HistoryRequest,
    RobotEvent,
    decode_arena_metadata,
    decode_event,
    decode_history_reply,
    decode_history_request,
    decode_robot_metadata,
    decode_scene,
    decode_state,
)
from tests.support.hostile_peer import telemetry
from tests.support.paths import ROOT
from tests.vectors.make import EVENTS, FOLDER, INITIATOR, TELEMETRY, plain

DOORS: dict[str, Callable[[bytes], Any]] = {
    "event": decode_event,
    "state": decode_state,
    "history_request": decode_history_request,
    "history_reply": decode_history_reply,
    "robot_metadata": decode_robot_metadata,
    "arena_metadata": decode_arena_metadata,
    "scene": decode_scene,
}
VECTORS = {name: (FOLDER / f"{name}.msgpack").read_bytes() for name in TELEMETRY}
MUTATIONS = 1500


def door_of(name: str) -> Callable[[bytes], Any]:
    return DOORS["event" if name.startswith("event_") else name]


def test_there_is_a_vector_for_every_kind_of_telemetry() -> None:
    """And for every event."""
    kinds = {type(message) for message in TELEMETRY.values()} | {type(e) for e in EVENTS.values()}
    wire = {k for k in Message.__subclasses__() if k.__module__ == telemetry.__name__}
    assert wire <= kinds
    assert {type(event) for event in EVENTS.values()} == set(RobotEvent.__args__)


def test_the_protocol_names_every_message_and_field_of_it() -> None:
    """PROTOCOL.md, from which a stranger writes an observer; a field of an event may stand with its type."""
    text = (ROOT / "PROTOCOL.md").read_text().partition("## Telemetry")[2]
    for message in (*TELEMETRY.values(), *EVENTS.values()):
        assert f"`{message.__struct_config__.tag}`" in text
        for name in message.__struct_fields__:
            assert f"`{name}`" in text, f"{type(message).__name__}.{name}"


class TestSettings:
    """What robots and arenas tell of their settings is JSON, and fits into a message."""

    def test_every_group_is_told_as_the_config_has_it(self) -> None:
        """A stranger reads it without this program."""
        config = load()
        message = json.loads(settings_of_robot(config, CyberRodent(camera_range_m=0.5)))
        assert set(message) == {"body", "learning", "life", "heredity"}
        assert message["body"]["camera_range_m"] == 0.5
        assert message["life"] == msgspec.to_builtins(config.life)

    def test_a_group_that_does_not_fit_is_left_out(self) -> None:
        """A thousand speeds do not keep a robot from telling the rest."""
        config = load(None, [f"learning.speeds_m_s={[0.1 + k / 1e5 for k in range(1500)]}"])
        text = settings_of_robot(config, config.body)
        assert set(json.loads(text)) == {"body", "life", "heredity"}
        assert len(text) <= MAX_ROBOT_SETTINGS
        assert settings_as_json({"life": config.life}, 2) == "{}"


@pytest.mark.parametrize("name", TELEMETRY)
def test_two_libraries_read_and_write_the_same(name: str) -> None:
    """msgspec, which robots use, and the independent msgpack."""
    message = door_of(name)(VECTORS[name])
    assert message == TELEMETRY[name]
    assert plain(message) == msgpack.unpackb(VECTORS[name])
    assert encode(message) == msgpack.packb(msgpack.unpackb(VECTORS[name])) == VECTORS[name]


@pytest.mark.parametrize("name", TELEMETRY)
def test_mutations_are_read_or_refused(name: str) -> None:
    """Bytes changed, lost and repeated: a value or WireError, nothing else, by the same seed on every run."""
    rng = random.Random(name)
    for _ in range(MUTATIONS):
        data = bytearray(VECTORS[name])
        for _ in range(rng.randint(1, 3)):
            at = rng.randrange(len(data) + 1)
            match rng.randrange(3):
                case 0:
                    data[at : at + 1] = bytes([rng.randrange(256)])
                case 1:
                    del data[at : at + rng.randint(1, 8)]
                case _:
                    data[at:at] = rng.randbytes(rng.randint(1, 8))
            if not data:
                break
        try:
            message = door_of(name)(bytes(data))
        except WireError:
            continue
        assert encode(message) == data


def test_a_state_without_a_body_is_a_state() -> None:
    """Its arena is the empty name; a name with a line end is none."""
    state = decode_state(VECTORS["state"])
    assert state.arena == ""
    with pytest.raises(WireError):
        decode_state(encode(msgspec.structs.replace(state, arena="lab\n")))


class TestRing:
    """A late or lossy observer can ask for what it missed."""

    def test_events_are_numbered_without_gaps(self) -> None:
        """From 1 in every life."""
        ring = EventBuffer(INITIATOR.id, 5)
        message = [decode_event(ring.append(Fault(k, "x"), 7)) for k in range(3)]
        assert message == [EventMessage(INITIATOR.id, 5, k + 1, 7, Fault(k, "x")) for k in range(3)]
        assert ring.seq == 3

    def test_asking_again_and_again_gives_everything_that_is_kept(self) -> None:
        """In answers of limited size, each of which can be decoded."""
        ring = EventBuffer(INITIATOR.id, 5)
        for k in range(11_000):
            ring.append(Fault(k, "x" * 300), 7)
        sample: list[int] = []
        first = 1
        while first <= ring.seq:
            past = decode_history_reply(encode(ring.reply_to(HistoryRequest(5, first))))
            assert 0 < len(past.events) <= MAX_HISTORY_EVENTS
            assert past.oldest == 1_001
            sample += [decode_event(data).seq for data in past.events]
            first = sample[-1] + 1
        assert sample == list(range(1_001, 11_001))

    def test_another_life_and_the_future_hold_nothing(self) -> None:
        """The answer says which life it is about."""
        ring = EventBuffer(INITIATOR.id, 5)
        ring.append(Fault(1, "x"), 7)
        assert ring.reply_to(HistoryRequest(4, 1)).events == []
        assert ring.reply_to(HistoryRequest(5, 2)).events == []
        assert ring.reply_to(HistoryRequest(4, 1)).incarnation == 5
