"""Keys and payloads become typed samples in one place; what is malformed, or contradicts its key, becomes none."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from crcolony.protocol.codec import Message, encode
from crcolony.protocol.key_expressions import ArenaKeys, ArenaToken, ColonyKeys, RobotToken
from crcolony.protocol.telemetry_messages import (
    ArenaMetadata,
    HistoryReply,
    RobotMetadata,
    Scene,
)
from crcolony.telemetry.samples import (
    ArenaMetadataSample,
    EventSample,
    HistorySample,
    MalformedSample,
    OfflineSample,
    OnlineSample,
    RawSample,
    RobotMetadataSample,
    SampleKind,
    SceneSample,
    StateSample,
    TelemetrySample,
    parse_sample,
)
from tests.support.fed_monitor import A_SCENE, ARENA, COLONY, ME, PEER, message, state
from tests.support.raw_samples import raw_sample


def parse(kind: SampleKind, key: str, message: Message | bytes = b"") -> TelemetrySample:
    payload = message if isinstance(message, bytes) else encode(message)
    return parse_sample(RawSample(kind, key, payload, 1_500))


def size(message: Message) -> int:
    return len(encode(message))


def test_every_kind_of_sample_is_parsed() -> None:
    """With the colony that its key names, and its time and size."""
    of_robot, of_arena = RobotMetadata(ME, 3, "{}", [PEER], ""), ArenaMetadata("lab", 7, "{}")
    robot_token, arena_token = RobotToken("blue", ME, 3, "a"), ArenaToken("lab", 7, "a")
    assert isinstance(A_SCENE, Scene)
    expected: list[TelemetrySample] = [
        OnlineSample(token=robot_token, unix_ms=1_500, size_bytes=0),
        OnlineSample(token=arena_token, unix_ms=1_500, size_bytes=0),
        OfflineSample(token=robot_token, unix_ms=1_500, size_bytes=0),
        OfflineSample(token=arena_token, unix_ms=1_500, size_bytes=0),
        StateSample(colony="blue", state=state(4), unix_ms=1_500, size_bytes=size(state(4))),
        EventSample(colony="blue", message=message(9), unix_ms=1_500, size_bytes=size(message(9))),
        SceneSample(scene=A_SCENE, unix_ms=1_500, size_bytes=size(A_SCENE)),
        RobotMetadataSample(
            colony="blue", metadata=of_robot, unix_ms=1_500, size_bytes=size(of_robot)
        ),
        ArenaMetadataSample(metadata=of_arena, unix_ms=1_500, size_bytes=size(of_arena)),
    ]
    assert [parse_sample(raw_sample(sample)) for sample in expected] == expected
    assert {sample.unix_s for sample in expected} == {1.5}


def test_a_reply_for_missed_events_keeps_those_that_are_well_formed() -> None:
    """The others, which are noise or of another robot, are counted."""
    events = [encode(message(1)), b"noise", encode(message(3)), encode(message(4, robot=PEER))]
    reply = HistoryReply(3, 1, events)
    assert parse("history", COLONY.history(ME), reply) == HistorySample(
        colony="blue",
        robot=ME,
        incarnation=3,
        oldest=1,
        messages=[message(1), message(3)],
        malformed=2,
        unix_ms=1_500,
        size_bytes=size(reply),
    )


@pytest.mark.parametrize(("events", "is_empty"), [([], True), ([b"noise"], False)])
def test_a_reply_is_empty_if_it_holds_nothing_at_all(events: list[bytes], is_empty: bool) -> None:
    """A malformed event is an event that the robot keeps."""
    sample = parse("history", COLONY.history(ME), HistoryReply(3, 1, events))
    assert isinstance(sample, HistorySample)
    assert sample.is_empty == is_empty


@pytest.mark.parametrize(
    ("kind", "key", "message"),
    [
        ("online", "crcolony/1/colony/blue/alive/nobody/3/abc", b""),
        ("online", COLONY.alive(ME, 3, "x" * 65), b""),
        ("online", ColonyKeys("b" * 65).alive(ME, 3, "x"), b""),
        ("offline", "crcolony/1/arena/lab/alive/x/abc", b""),
        ("state", COLONY.state(ME), b"\xc1"),
        ("state", COLONY.state(PEER), state()),
        ("state", COLONY.event(ME), state()),
        ("state", "crcolony/1/colony/blue/state/x", state()),
        ("event", COLONY.event(ME), b""),
        ("event", COLONY.event(PEER), message(1)),
        ("event", COLONY.event(ME), message(0)),
        ("scene", ARENA.scene, b"\x90"),
        ("scene", ArenaKeys("other").scene, A_SCENE),
        ("history", COLONY.history(ME), b"noise"),
        ("history", COLONY.event(ME), HistoryReply(3, 1, [])),
        ("metadata", COLONY.metadata(PEER), RobotMetadata(ME, 3, "{}", [], "")),
        ("metadata", COLONY.metadata(ME), RobotMetadata(ME, 3, "[1]", [], "")),
        ("metadata", COLONY.metadata(ME), RobotMetadata(ME, 3, "[" * 8000, [], "")),
        ("metadata", ARENA.metadata, ArenaMetadata("other", 7, "{}")),
        ("metadata", ARENA.metadata, ArenaMetadata("lab", 7, "nothing")),
        ("metadata", ARENA.metadata, RobotMetadata(ME, 3, "{}", [], "")),
    ],
)
def test_malformed_keys_and_payloads_are_refused(
    kind: SampleKind, key: str, message: Message | bytes
) -> None:
    """So are payloads that name another robot or arena than their keys; the reason and the size are kept."""
    sample = parse(kind, key, message)
    assert isinstance(sample, MalformedSample)
    assert sample.kind == kind
    assert sample.reason
    assert sample.size_bytes == len(message if isinstance(message, bytes) else encode(message))


@given(
    st.sampled_from(("online", "offline", "state", "event", "scene", "history", "metadata")),
    st.sampled_from((COLONY.state(ME), COLONY.history(ME), ARENA.metadata, "", "crcolony/1/x")),
    st.binary(max_size=200),
)
def test_no_bytes_raise_an_error(kind: SampleKind, key: str, payload: bytes) -> None:
    """Whatever arrives is a sample of its kind."""
    sample = parse_sample(RawSample(kind, key, payload, 0))
    assert sample.kind == kind
    assert sample.size_bytes == len(payload)
