"""A monitor reports each event once, knows what it has missed, and counts what it cannot use."""

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crcolony.nodes.event_buffer import EventBuffer
from crcolony.protocol.codec import encode
from crcolony.protocol.telemetry_messages import (
    ArenaMetadata,
    EventMessage,
    Fault,
    HistoryReply,
    RobotMetadata,
    decode_history_request,
)
from crcolony.telemetry.backfill import REPLY_TIMEOUT_S
from crcolony.telemetry.sequence_gaps import REQUEST_DELAY_S
from crcolony.telemetry.status_changes import (
    ArenaChanged,
    EventReceived,
    RobotRestarted,
    StatusChange,
)
from tests.support.fed_monitor import (
    ARENA,
    COLONY,
    IDS,
    ME,
    PEER,
    FedMonitor,
    T,
    message,
    numbers,
    state,
)


@pytest.fixture
def monitor() -> FedMonitor:
    return FedMonitor()


class TestEvents:
    """Each event of each incarnation is reported exactly once."""

    def test_repeated_events_are_not_reported_and_late_ones_are(self, monitor: FedMonitor) -> None:
        """An event is missed until it arrives."""
        events = (message(5), message(5), message(9), message(7), message(7))
        assert monitor.events(*events) == [5, 9, 7]
        assert monitor.robots[ME].missed == 2
        assert monitor.events(message(6), message(8), message(6)) == [6, 8]
        assert monitor.robots[ME].missed == 0

    def test_a_state_shows_that_events_were_missed(self, monitor: FedMonitor) -> None:
        """Events before the first sample of an incarnation are not missed."""
        monitor.state(state(seq=20))
        assert monitor.robots[ME].missed == 0
        monitor.state(state(seq=22))
        assert monitor.robots[ME].missed == 2
        assert (monitor.robots[ME].state, monitor.robots[ME].updated_s) == (state(seq=22), T)

    def test_a_newer_incarnation_has_its_own_sequence_numbers(self, monitor: FedMonitor) -> None:
        """Late events of the incarnation before are reported if they were missing; others are counted as stale."""
        monitor.events(message(5), message(9))
        changes = monitor.handle("event", COLONY.event(ME), message(1, incarnation=4))
        assert changes == [RobotRestarted(ME, 4), EventReceived(message(1, incarnation=4))]
        late = (message(7), message(7), message(10), message(3, incarnation=2))
        assert monitor.events(*late) == [7]
        assert monitor.stale == 3
        assert monitor.robots[ME].missed == 2

    def test_states_of_an_older_incarnation_are_ignored(self, monitor: FedMonitor) -> None:
        """And counted as stale."""
        monitor.state(state(seq=20, incarnation=4))
        monitor.state(state(seq=30, incarnation=3))
        assert monitor.robots[ME].state == state(seq=20, incarnation=4)
        assert (monitor.stale, monitor.robots[ME].missed) == (1, 0)

    def test_missed_events_of_many_incarnations_add_up(self, monitor: FedMonitor) -> None:
        """Three in each."""
        for incarnation in range(10):
            monitor.events(message(1, incarnation), message(5, incarnation))
        assert monitor.robots[ME].missed == 30


@given(
    st.lists(st.sampled_from(["lost", "once", "twice", "late"]), min_size=1, max_size=300),
    st.lists(st.booleans(), max_size=40),
)
def test_each_event_is_reported_once_whatever_is_lost_repeated_or_late(
    fates: list[str], replies: list[bool]
) -> None:
    """Published events and replies can be lost; after all replies nothing is missing."""
    monitor, buffer, reported = FedMonitor(history=10_000), EventBuffer(ME, 3), list[int]()
    monitor.online(3)
    late: list[EventMessage] = []
    for fate in fates:
        event = msgspec.msgpack.decode(buffer.append(Fault(0, "x"), 7), type=EventMessage)
        reported += monitor.events(*([event] * {"once": 1, "twice": 2}.get(fate, 0)))
        late += [event] if fate == "late" else []
    monitor.state(state(seq=buffer.seq))
    chances = iter(replies)
    while monitor.missing():
        monitor.now_s += REQUEST_DELAY_S
        for request in monitor.due_requests(monitor.now_s):
            if request.kind == "history" and next(chances, True):
                reply = encode(buffer.reply_to(decode_history_request(request.payload)))
                reported += numbers(monitor.handle("history", request.key, reply))
        reported += monitor.events(*late[:3])
        late = late[2:]
        monitor.now_s += REPLY_TIMEOUT_S
    reported += monitor.events(*late)
    robot = monitor.robots[ME]
    assert len(reported) == len(set(reported))
    assert robot.missed == buffer.seq - len(reported)
    if all(replies):
        assert sorted(reported) == list(range(1, buffer.seq + 1))


class TestMetadata:
    """Replies to requests for metadata."""

    def test_the_metadata_of_the_present_incarnation_is_kept(self, monitor: FedMonitor) -> None:
        """That of an older one is counted as stale."""
        metadata = RobotMetadata(ME, 3, '{"body":{}}', [PEER], "")
        monitor.online(3)
        monitor.metadata(metadata)
        monitor.metadata(RobotMetadata(ME, 2, "{}", [], ""))
        assert monitor.robots[ME].metadata == metadata
        assert monitor.stale == 1


class TestMalformed:
    """Anyone can publish anything: it is counted, and costs little."""

    def test_a_malformed_sample_is_counted_and_changes_nothing(self, monitor: FedMonitor) -> None:
        """By its kind and its size, too."""
        assert monitor.handle("state", COLONY.state(ME), b"noise") == []
        assert monitor.malformed == 1
        assert monitor.robots == {}
        assert monitor.arenas == {}
        assert monitor.samples == {"state": 1}
        assert monitor.bytes == 5

    @pytest.mark.parametrize(("robot", "event"), [(PEER, encode(message(1))), (ME, b"noise")])
    def test_a_reply_without_a_well_formed_event_creates_no_robot(
        self, monitor: FedMonitor, robot: bytes, event: bytes
    ) -> None:
        """An event of another robot, or noise."""
        reply = HistoryReply(3, 1, [event])
        assert monitor.handle("history", COLONY.history(robot), reply) == []
        assert monitor.malformed == 1
        assert monitor.robots == {}

    def test_one_malformed_event_does_not_spoil_a_reply(self, monitor: FedMonitor) -> None:
        """The others are reported."""
        events = [encode(message(1)), b"noise", encode(message(3)), encode(message(4, robot=PEER))]
        changes = monitor.handle("history", COLONY.history(ME), HistoryReply(3, 1, events))
        assert numbers(changes) == [1, 3]
        assert monitor.malformed == 2


def test_robots_are_in_order_of_number_and_id(monitor: FedMonitor) -> None:
    """Robots without a state come last."""
    for robot in IDS[:4]:
        monitor.online(3, robot)
    for number, robot in ((7, IDS[0]), (2, IDS[1]), (2, IDS[2])):
        monitor.state(msgspec.structs.replace(state(robot=robot), number=number))
    monitor.offline(3, IDS[0])
    assert [status.robot for status in monitor.all] == [*sorted(IDS[1:3]), IDS[0], IDS[3]]
    assert [status.robot for status in monitor.alive] == [*sorted(IDS[1:3]), IDS[3]]


def test_an_arena_restarted_with_other_settings_is_a_change() -> None:
    """Every setting is named with both values; the first reply of a run counts."""
    monitor = FedMonitor()

    def reply(arena_run: int, packs: int) -> list[StatusChange]:
        settings = f'{{"arena":{{"packs":{packs}}}}}'
        return monitor.handle("metadata", ARENA.metadata, ArenaMetadata("lab", arena_run, settings))

    assert reply(1, 8) == []
    assert reply(2, 8) == []
    assert reply(3, 12) == [ArenaChanged("lab", ("arena.packs 8 → 12",))]
    assert reply(3, 12) == []
