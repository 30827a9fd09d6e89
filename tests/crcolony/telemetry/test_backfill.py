"""Missed events and metadata are requested few at a time, with limited retries, and once at a time from each node."""

import pytest

from crcolony.protocol.telemetry_messages import ArenaMetadata, HistoryRequest, RobotMetadata
from crcolony.telemetry.backfill import MAX_PENDING, REPLY_TIMEOUT_S, ROBOTS_PER_PERIOD
from crcolony.telemetry.sequence_gaps import MAX_TRIES, REQUEST_DELAY_S
from tests.support.fed_monitor import (
    A_SCENE,
    ARENA,
    COLONY,
    IDS,
    ME,
    PEER,
    FedMonitor,
    T,
    message,
    state,
)


@pytest.fixture
def monitor() -> FedMonitor:
    return FedMonitor()


def test_missing_events_are_requested(monitor: FedMonitor) -> None:
    """Of a robot that is online, one request at a time, until nothing is missing."""
    monitor.events(message(1), message(100))
    assert monitor.requests() == []
    monitor.online(3)
    assert monitor.requests() == [(COLONY.metadata(ME), None)]
    assert monitor.requests() == []
    monitor.metadata(RobotMetadata(ME, 3, "{}", [PEER], ""))
    assert monitor.requests() == [(COLONY.history(ME), HistoryRequest(3, 2))]
    assert monitor.requests() == []
    assert monitor.history(1, [message(seq) for seq in range(2, 66)]) == [*range(2, 66)]
    assert monitor.requests() == [(COLONY.history(ME), HistoryRequest(3, 66))]
    monitor.history(1, [message(seq) for seq in range(66, 130)])
    assert monitor.requests() == []
    assert monitor.robots[ME].missed == 0


def test_earlier_events_are_requested_as_far_back_as_wanted() -> None:
    """Events that the robot keeps no longer are not missed."""
    monitor = FedMonitor(history=50)
    monitor.online_with_metadata()
    monitor.state(state(seq=200))
    assert monitor.requests() == [(COLONY.history(ME), HistoryRequest(3, 151))]
    assert monitor.history(190, [message(seq) for seq in range(190, 201)]) == [*range(190, 201)]
    assert monitor.requests() == []
    assert monitor.robots[ME].missed == 0


def test_a_request_without_a_reply_is_given_up_after_some_tries(monitor: FedMonitor) -> None:
    """Its events are missed then; the metadata of a new incarnation is requested again."""
    monitor.online(3)
    monitor.events(message(1), message(9))
    rounds = [monitor.requests(T + REPLY_TIMEOUT_S * k) for k in range(4 * MAX_TRIES)]
    keys = [key for requests in rounds for key, _ in requests]
    assert keys.count(COLONY.history(ME)) == MAX_TRIES
    assert keys.count(COLONY.metadata(ME)) >= MAX_TRIES
    assert monitor.robots[ME].missed == 7
    monitor.online(4, session="b")
    assert (COLONY.metadata(ME), None) in monitor.requests(T + 1_000.0)


def test_an_event_that_never_existed_is_requested_once(monitor: FedMonitor) -> None:
    """A forged state costs a request, and no later event."""
    monitor.online_with_metadata()
    monitor.events(message(1))
    monitor.state(state(seq=2**50))
    requests = monitor.requests(T + REQUEST_DELAY_S)
    assert requests == [(COLONY.history(ME), HistoryRequest(3, 2))]
    monitor.history(1, [])
    assert monitor.requests(T + REQUEST_DELAY_S) == []
    assert monitor.robots[ME].missed == 0
    assert monitor.events(message(2), message(4)) == [2, 4]
    assert monitor.robots[ME].missed == 1


def test_few_requests_are_pending_and_every_robot_has_its_turn(monitor: FedMonitor) -> None:
    """Robots that never reply do not block the others."""
    for robot in IDS:
        monitor.online(3, robot)
        monitor.events(message(1, robot=robot), message(3, robot=robot))
    requested: set[str] = set()
    for k in range(60):
        requests = monitor.due_requests(T + REPLY_TIMEOUT_S * k)
        assert len(requests) <= MAX_PENDING
        robots = [request.key.rpartition("/")[2] for request in requests]
        assert len(set(robots)) == len(robots)
        requested |= {request.key for request in requests}
    assert requested >= {COLONY.history(robot) for robot in IDS}
    assert requested >= {COLONY.metadata(robot) for robot in IDS}


def test_metadata_is_requested_again_in_turn() -> None:
    """Of some robots in every period, but not of robots that are offline."""
    monitor = FedMonitor(metadata_period_s=50.0)
    for robot in IDS:
        monitor.online(3, robot)
    monitor.offline(3, IDS[0])

    def requested(from_s: float) -> list[str]:
        """Return the keys of half a period, in which all robots reply at once."""
        keys = []
        for k in range(20):
            for key, _ in monitor.requests(from_s + k):
                robot = bytes.fromhex(key.rpartition("/")[2])
                monitor.metadata(RobotMetadata(robot, 3, "{}", [], ""))
                keys.append(key)
        return keys

    online = {COLONY.metadata(robot) for robot in IDS[1:]}
    assert set(requested(T)) == online
    again = [requested(T + 50.0 * k) for k in range(1, 5)]
    assert [len(keys) for keys in again] == [ROBOTS_PER_PERIOD] * 4
    assert {key for keys in again for key in keys} == online


def test_the_metadata_of_an_arena_is_requested_once_in_every_run(monitor: FedMonitor) -> None:
    """Its reply is kept."""
    metadata = ArenaMetadata("lab", 7, '{"arena":{}}')
    monitor.handle("online", ARENA.alive(7, "a"))
    assert monitor.requests() == [(ARENA.metadata, None)]
    monitor.handle("metadata", ARENA.metadata, metadata)
    assert monitor.arenas["lab"].metadata == metadata
    monitor.handle("scene", ARENA.scene, A_SCENE)
    assert monitor.requests(T + 1_000.0) == []
    monitor.handle("online", ARENA.alive(8, "b"))
    assert monitor.requests(T + 1_000.0) == [(ARENA.metadata, None)]


def test_a_clock_that_is_set_back_delays_no_request(monitor: FedMonitor) -> None:
    """A pending request from the future counts as unanswered."""
    monitor.online(3)
    assert len(monitor.requests(T + 1e6)) == 1
    assert len(monitor.requests(T)) == 1
