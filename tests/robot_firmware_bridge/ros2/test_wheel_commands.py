"""A motion lasts for its time to live and no longer, and a latch leaves nothing but standing still."""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from crcolony_bridge.ros2.wheel_commands import WheelCommands

STILL = (0.0, 0.0)


class Base:
    """Keeps what it is commanded, and when."""

    def __init__(self) -> None:
        self.commands: list[tuple[float, float]] = []
        self.times_s: list[float] = []
        self._changed = threading.Condition()

    def send(self, ahead_m_s: float, turn_rad_s: float) -> None:
        """Take a command."""
        with self._changed:
            self.commands.append((ahead_m_s, turn_rad_s))
            self.times_s.append(time.monotonic())
            self._changed.notify_all()

    def wait_for(self, count: int) -> None:
        """Wait until there were so many commands."""
        with self._changed:
            assert self._changed.wait_for(lambda: len(self.commands) >= count, 5.0), self.commands


@contextmanager
def commanded(*, is_latched: bool = False) -> Iterator[tuple[Base, WheelCommands]]:
    base = Base()
    commands = WheelCommands(base.send, is_latched=is_latched)
    try:
        yield base, commands
    finally:
        commands.close()


def test_a_motion_ends_when_its_time_is_over() -> None:
    """That is said three times, and then nothing more: the base may be another one's."""
    with commanded() as (base, commands):
        commands.drive(0.2, 1.0, ttl_s=0.05)
        base.wait_for(4)
        assert base.commands == [(0.2, 1.0), STILL, STILL, STILL]
        assert 0.05 <= base.times_s[1] - base.times_s[0] < 0.3
        assert not threading.Event().wait(0.15)
        assert len(base.commands) == 4


def test_a_fresh_command_has_its_own_time() -> None:
    """The end of the first one is forgotten."""
    with commanded() as (base, commands):
        commands.drive(0.2, 0.0, ttl_s=0.05)
        commands.drive(0.1, 0.0, ttl_s=0.2)
        base.wait_for(3)
        assert base.commands[1:] == [(0.1, 0.0), STILL]
        assert base.times_s[2] - base.times_s[1] >= 0.2


def test_a_time_to_live_of_nothing_is_no_motion() -> None:
    """It is sent as standing still, once."""
    with commanded() as (base, commands):
        commands.drive(0.2, 0.0, ttl_s=0.0)
        commands.stand_still()
        assert base.commands == [STILL, STILL]


def test_a_latch_stops_at_once_and_lets_nothing_through() -> None:
    """It is repeated until it is released; then motion is possible again."""
    with commanded() as (base, commands):
        commands.drive(0.2, 0.0, ttl_s=5.0)
        commands.latch()
        assert base.commands[1:] == [STILL]
        commands.drive(0.2, 0.0, ttl_s=5.0)
        base.wait_for(4)
        assert base.commands[1:] == [STILL] * (len(base.commands) - 1)
        assert commands.latched_s is not None
        commands.release()
        assert commands.latched_s is None
        commands.drive(0.1, 0.0, ttl_s=5.0)
        assert base.commands[-1] == (0.1, 0.0)


def test_a_latch_from_before_holds_from_the_start() -> None:
    """As for a robot that is back after a loss."""
    with commanded(is_latched=True) as (base, commands):
        commands.drive(0.2, 0.0, ttl_s=5.0)
        base.wait_for(2)
        assert set(base.commands) == {STILL}


def test_at_the_end_the_base_is_told_to_stand_still() -> None:
    """Once, however often it is closed; nothing is commanded afterwards."""
    with commanded() as (base, commands):
        commands.drive(0.2, 0.0, ttl_s=5.0)
        commands.close()
        commands.close()
        commands.drive(0.2, 0.0, ttl_s=5.0)
    assert base.commands == [(0.2, 0.0), STILL]
