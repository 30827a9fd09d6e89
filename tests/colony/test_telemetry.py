"""Observers read what robots tell, learn what they missed, and no telemetry makes them do anything but count it."""

import random
from collections.abc import Callable
from typing import Any

import msgpack  # type: ignore[import-untyped]
import msgspec
import pytest

from crcolony.colony import telemetry
from crcolony.colony.messages import Message, WireError, encode
from crcolony.colony.telemetry import PAST_EVENTS, Ask, Fault, Ring, Told
from crcolony.colony.watch import Watch
from tests.vectors.make import EVENTS, FOLDER, INITIATOR, TELEMETRY, plain

DOORS: dict[str, Callable[[bytes], Any]] = {
    "told": telemetry.decode_told,
    "state": telemetry.decode_state,
    "ask": telemetry.decode_ask,
    "past": telemetry.decode_past,
    "scene": telemetry.decode_scene,
}
VECTORS = {name: (FOLDER / f"{name}.msgpack").read_bytes() for name in TELEMETRY}
MUTATIONS = 1500


def door_of(name: str) -> Callable[[bytes], Any]:
    return DOORS[name.partition("_")[0]]


def test_there_is_a_vector_for_every_kind_of_telemetry() -> None:
    """And for every event."""
    kinds = {type(message) for message in TELEMETRY.values()} | {type(e) for e in EVENTS.values()}
    wire = {k for k in Message.__subclasses__() if k.__module__ == telemetry.__name__}
    assert wire <= kinds
    assert {type(event) for event in EVENTS.values()} == set(telemetry.Event.__args__)


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
    state = telemetry.decode_state(VECTORS["state"])
    assert state.arena == ""
    with pytest.raises(WireError):
        telemetry.decode_state(encode(msgspec.structs.replace(state, arena="lab\n")))


class TestRing:
    """A late or lossy observer can ask for what it missed."""

    def test_events_are_numbered_without_gaps(self) -> None:
        """From 1 in every life."""
        ring = Ring(INITIATOR.id, 5)
        told = [telemetry.decode_told(ring.add(Fault(k, "x"), 7)) for k in range(3)]
        assert told == [Told(INITIATOR.id, 5, k + 1, 7, Fault(k, "x")) for k in range(3)]
        assert ring.seq == 3

    def test_asking_again_and_again_gives_everything_that_is_kept(self) -> None:
        """In answers of limited size, each of which can be decoded."""
        ring = Ring(INITIATOR.id, 5)
        for k in range(11_000):
            ring.add(Fault(k, "x" * 300), 7)
        heard: list[int] = []
        first = 1
        while first <= ring.seq:
            past = telemetry.decode_past(encode(ring.answer(Ask(5, first))))
            assert 0 < len(past.events) <= PAST_EVENTS
            assert past.oldest == 1_001
            heard += [telemetry.decode_told(data).seq for data in past.events]
            first = heard[-1] + 1
        assert heard == list(range(1_001, 11_001))

    def test_another_life_and_the_future_hold_nothing(self) -> None:
        """The answer says which life it is about."""
        ring = Ring(INITIATOR.id, 5)
        ring.add(Fault(1, "x"), 7)
        assert ring.answer(Ask(4, 1)).events == []
        assert ring.answer(Ask(5, 2)).events == []
        assert ring.answer(Ask(4, 1)).life == 5


class TestWatch:
    """A watcher keeps the latest, knows what it missed, and is never thrown by what it hears."""

    def test_gaps_are_counted_and_repetitions_are_not(self) -> None:
        """Whatever order they come in."""
        watch = Watch()
        watch.told_state("crcolony/1/colony/blue/state/x", VECTORS["state"], 1.0)
        ring = Ring(INITIATOR.id, 3)
        told = [ring.add(Fault(k, "x"), 7) for k in range(10)]
        for data in (told[0], told[1], told[5], told[5], told[9]):
            watch.told_event(data)
        assert watch.robots[INITIATOR.id].missed == 6

    def test_tokens_tell_who_is_alive_in_which_life(self) -> None:
        """A robot with two lives is alive until both are gone."""
        watch = Watch()
        key = f"crcolony/1/colony/blue/alive/{INITIATOR.id.hex()}"
        watch.token(f"{key}/3/abc", True)
        watch.token(f"{key}/4/def", True)
        watch.token(f"{key}/3/abc", False)
        assert [watched.robot for watched in watch.alive] == [INITIATOR.id]
        watch.token(f"{key}/4/def", False)
        assert watch.alive == []
        watch.token("crcolony/1/arena/lab/alive/7/abc", True)
        assert watch.arenas == {"lab": {"abc"}}

    def test_what_is_malformed_is_counted(self) -> None:
        """Keys and messages of every kind."""
        watch = Watch()
        watch.token("crcolony/1/colony/blue/alive/nobody/3/abc", True)
        watch.token("crcolony/1/colony/blue/alive/00/x/abc", True)
        watch.told_state("crcolony/1/colony/blue/state/x", b"\xc1", 1.0)
        watch.told_event(b"")
        watch.told_scene(b"\x90")
        assert watch.malformed == 5
        assert watch.robots == {}
