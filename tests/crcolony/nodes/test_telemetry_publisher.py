"""Observers receive a robot's state and events, and replies to their queries, at a limited rate."""

import hashlib

import msgspec

from crcolony.body.settings import CyberRodent
from crcolony.protocol.codec import encode
from crcolony.protocol.telemetry_messages import (
    MAX_REPORTED_PEERS,
    Fault,
    HistoryRequest,
    RobotMetadata,
    decode_event,
    decode_history_reply,
    decode_robot_metadata,
    decode_state,
)
from crcolony.transport.interface import RobotOnline
from tests.support.lone_robot import ME, PEER, LoneRobot
from tests.support.small_colony import small


def metadata_of(lone: LoneRobot) -> RobotMetadata:
    (reply,) = lone.query("metadata", b"")
    return decode_robot_metadata(reply)


def test_metadata_are_the_robots_settings_and_peers(lone: LoneRobot) -> None:
    """The body is the config's until the arena grants another."""
    config = small()
    metadata = metadata_of(lone)
    assert (metadata.robot, metadata.incarnation, metadata.peers) == (
        ME.id,
        lone.node.incarnation,
        [],
    )
    groups = msgspec.json.decode(metadata.settings)
    assert set(groups) == {"body", "learning", "life", "heredity"}
    for name, settings in groups.items():
        assert msgspec.convert(settings, type(group := getattr(config, name))) == group
    lone.robot.handle_event(0.0, RobotOnline(PEER.id, 1, "theirs"))
    body = msgspec.json.encode(CyberRodent(camera_range_m=0.75)).decode()
    lone.grant_body(0.0, body=body)
    metadata = metadata_of(lone)
    assert metadata.peers == [PEER.id]
    assert msgspec.json.decode(metadata.settings)["body"]["camera_range_m"] == 0.75


def test_metadata_have_the_text_whose_digest_a_mating_quotes(lone: LoneRobot) -> None:
    """So a robot of any make learns which genes it needs."""
    schema = lone.node.robot.subpopulation.schema
    text = metadata_of(lone).schema
    assert hashlib.blake2b(text.encode(), digest_size=16).hexdigest() == schema.digest
    assert [line.rpartition(" ")[0].rpartition(" ")[0] for line in text.splitlines()] == [
        gene.name for gene in schema.genes
    ]


def test_of_many_peers_some_are_reported(lone: LoneRobot) -> None:
    """As many as a message holds."""
    for number in range(MAX_REPORTED_PEERS + 5):
        lone.robot.handle_event(0.0, RobotOnline(number.to_bytes(16), 1, "theirs"))
    assert len(metadata_of(lone).peers) == MAX_REPORTED_PEERS


def test_a_robot_answers_a_hundred_queries_a_second(lone: LoneRobot) -> None:
    """Of both kinds together; malformed queries, and those above the limit, are faults."""
    request = encode(HistoryRequest(lone.node.incarnation, 1))
    (reply,) = lone.query("history", request)
    assert len(decode_history_reply(reply).events) == 4, "its births"
    replies = [*(lone.query("history", request) + lone.query("metadata", b"") for _ in range(80))]
    assert sum(map(len, replies)) == 99
    assert lone.node.telemetry.faults == {"malformed query": 61}
    lone.unix_s += 1.0
    assert not lone.query("history", b"")
    assert not lone.query("metadata", b"?")
    assert lone.node.telemetry.faults == {"malformed query": 63}
    assert metadata_of(lone)


def test_faults_are_counted_by_kind_and_published_at_a_limited_rate(lone: LoneRobot) -> None:
    """A hundred at once are all counted, and ten of them published; the text of each is bounded."""
    for number in range(100):
        lone.node.report_fault(f"something: {number} " + 600 * "x")
    faults = [event for event in lone.events if isinstance(event, Fault)]
    assert lone.node.telemetry.faults == {"something": 100}
    assert len(faults) == 10
    assert all(len(fault.what) == 500 for fault in faults)


def test_events_are_numbered_and_published_with_the_time_of_day(lone: LoneRobot) -> None:
    """What is published is what `on_event` receives."""
    messages = [decode_event(data) for topic, data in lone.transport.telemetry if topic == "event"]
    assert [message.seq for message in messages] == [1, 2, 3, 4]
    assert [message.event for message in messages] == lone.events
    assert {message.unix_ms for message in messages} == {1_000_000}


def test_the_state_is_published(lone: LoneRobot) -> None:
    """With the number of the last event, of peers, and of faults."""
    lone.robot.handle_event(0.0, RobotOnline(PEER.id, 1, "theirs"))
    lone.node.report_fault("something")
    lone.node.publish_state(dropped=3)
    (state,) = [decode_state(data) for topic, data in lone.transport.telemetry if topic == "state"]
    assert (state.robot, state.peers, state.faults, state.dropped) == (ME.id, 1, 1, 3)
    assert state.seq == lone.node.telemetry.seq == 5


def test_a_clock_before_1970_is_reported_as_1970(lone: LoneRobot) -> None:
    """A message cannot hold an earlier time."""
    lone.unix_s = -1e9
    assert lone.node.state(0).unix_ms == 0
