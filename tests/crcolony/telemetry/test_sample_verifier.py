"""An observer believes what robots and arenas have signed, in its order, and as much a second as it can afford."""

import itertools
from collections.abc import Iterable

from crcolony.protocol.identity import Identity, seeded
from crcolony.protocol.key_expressions import ArenaKeys, ColonyKeys
from crcolony.protocol.signed_telemetry import purpose_of_arena, purpose_of_robot, sign_telemetry
from crcolony.telemetry.sample_verifier import SampleVerifier
from crcolony.telemetry.samples import RawSample, SampleKind

BLUE, LAB = ColonyKeys("blue"), ArenaKeys("lab")
ROBOT, OTHER, ARENA, IMPOSTOR = (seeded("test", 1, number) for number in range(4))
T = 1_000.0


def of_robot(
    kind: SampleKind, content: bytes, count: int = 0, by: Identity = ROBOT, about: Identity = ROBOT
) -> RawSample:
    """Return what a robot has told about a robot."""
    keys = {"state": BLUE.state, "event": BLUE.event, "history": BLUE.history}
    payload = sign_telemetry(content, purpose_of_robot("blue"), by, count)
    return RawSample(kind, keys[kind](about.id), payload, 0)


def scene(content: bytes, by: Identity = ARENA) -> RawSample:
    """Return a scene of an arena."""
    return RawSample("scene", LAB.scene, sign_telemetry(content, purpose_of_arena("lab"), by), 0)


def believed(
    verifier: SampleVerifier, samples: Iterable[RawSample], now_s: float = T
) -> list[bytes]:
    return [raw.payload for raw in verifier.open_all(now_s, samples)]


def test_what_a_robot_has_signed_is_believed_without_the_signature() -> None:
    """States, events and replies; tokens pass as they are."""
    samples = [of_robot("event", b"event"), of_robot("history", b"history")]
    assert believed(SampleVerifier(), samples) == [b"event", b"history"]
    assert believed(SampleVerifier(), [of_robot("state", b"state")]) == [b"state"]
    token = RawSample("online", BLUE.alive(ROBOT.id, 1, "a"), b"", 0)
    assert list(SampleVerifier().open_all(T, [token])) == [token]


def test_what_another_has_signed_is_refused_and_counted() -> None:
    """In a robot's name, for another colony, changed, or not signed at all."""
    genuine = of_robot("event", b"event")
    forged = [
        of_robot("event", b"event", by=OTHER),
        genuine._replace(key=ColonyKeys("red").event(ROBOT.id)),
        genuine._replace(payload=b"E" + genuine.payload[1:]),
        genuine._replace(payload=b"event"),
        genuine._replace(key="no key of ours"),
    ]
    verifier = SampleVerifier()
    assert believed(verifier, forged) == []
    assert verifier.refused == len(forged)


def test_an_old_state_does_not_come_back() -> None:
    """By its count, which the signature covers."""
    verifier = SampleVerifier()
    first, second = of_robot("state", b"first", 1), of_robot("state", b"second", 2)
    assert believed(verifier, [second]) == [b"second"]
    assert believed(verifier, [first]) == []
    assert believed(verifier, [second]) == []
    assert verifier.refused == 2


def test_the_last_of_several_states_counts() -> None:
    """Of each robot; older ones that wait are never verified."""
    states = [of_robot("state", b"%d" % count, count) for count in range(1, 6)]
    assert believed(SampleVerifier(), states) == [b"5"]


def test_states_wait_for_their_turn() -> None:
    """At most five hundred a second are verified; all robots have their turn."""
    robots = [seeded("many", 1, number) for number in range(700)]
    states = [of_robot("state", b"%d" % n, 1, one, one) for n, one in enumerate(robots)]
    verifier = SampleVerifier()
    first = believed(verifier, states)
    assert 400 <= len(first) <= 500
    rest = believed(verifier, [], T + 1.0)
    assert sorted([*first, *rest], key=int) == [b"%d" % number for number in range(700)]


def test_floods_are_not_verified() -> None:
    """At most two thousand other samples a second; the rest is counted."""
    verifier = SampleVerifier()
    flood = itertools.repeat(of_robot("event", b"event", by=OTHER), 5_000)
    assert believed(verifier, flood) == []
    assert verifier.refused <= 2_000
    assert verifier.skipped == 5_000 - verifier.refused
    assert believed(verifier, [of_robot("event", b"event")], T + 1.0) == [b"event"]


def test_the_first_arena_of_a_name_is_believed_until_it_is_silent() -> None:
    """So an impostor that was first is not believed for long after it has ended."""
    verifier = SampleVerifier()
    assert believed(verifier, [scene(b"false", IMPOSTOR)]) == [b"false"]
    assert believed(verifier, [scene(b"true")], T + 1.0) == []
    assert believed(verifier, [scene(b"true")], T + 3.5) == [b"true"]
    assert believed(verifier, [scene(b"false", IMPOSTOR)], T + 4.0) == []
