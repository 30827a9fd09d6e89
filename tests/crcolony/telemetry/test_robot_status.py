"""A robot's status counts its missed events over all incarnations."""

from crcolony.telemetry.robot_status import ArenaStatus, RobotStatus
from tests.support.fed_monitor import ME, message


def robot() -> RobotStatus:
    status = RobotStatus(ME, "blue")
    status.start_incarnation(3)
    return status


def record(status: RobotStatus, *numbers: int) -> None:
    """Record events of the present incarnation."""
    for seq in numbers:
        status.track_events(seq - 1, history=0).record(seq, 0.0)


def test_a_robot_and_an_arena_are_alive_while_they_have_a_token() -> None:
    """Any token of any incarnation or run."""
    for status in (robot(), ArenaStatus("lab")):
        assert not status.is_alive
        status.tokens.add((1, "a"))
        assert status.is_alive
        status.tokens.remove((1, "a"))
        assert not status.is_alive


def test_missed_events_of_all_incarnations_add_up() -> None:
    """Three in each of ten."""
    status = robot()
    for incarnation in range(4, 14):
        record(status, 1, 5)
        status.start_incarnation(incarnation)
    assert status.missed == 30


def test_an_event_of_the_incarnation_before_is_accepted_if_it_was_missing() -> None:
    """Once; events of earlier incarnations are not accepted."""
    status = robot()
    record(status, 1, 3)
    status.start_incarnation(4)
    assert status.missed == 1
    assert not status.record_late_event(message(1))
    assert status.record_late_event(message(2))
    assert not status.record_late_event(message(2))
    assert status.missed == 0
    record(status, 1)
    status.start_incarnation(5)
    assert not status.record_late_event(message(2, incarnation=3))
