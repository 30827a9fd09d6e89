"""An emergency stop reaches all robots, names those that have not confirmed, and is released by its own latch alone."""

from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from crcolony.protocol.codec import encode
from crcolony.protocol.stop_messages import (
    Clear,
    Stop,
    StopAddress,
    StopReply,
    decode_stop_reply,
)
from crcolony.runtime.stop_server import StopServer
from tests.robot_firmware_bridge.fake_driver import AttachedFakes
from tests.support.process import wait_until

ID = bytes(16)
ADDRESS, OTHER = StopAddress("lab", "a1"), StopAddress("arena", "b2")


class Setup(AttachedFakes):
    """Three robots and their stop."""

    def __init__(self) -> None:
        super().__init__(3)
        self.stop = StopServer(self.robots, self.lines.append)

    def ask(self, message: Stop | Clear) -> StopReply:
        """Send a message and return the reply."""
        reply = self.stop.answer(encode(message), ADDRESS, [OTHER])
        assert reply is not None
        return decode_stop_reply(reply)


@pytest.fixture
def setup() -> Iterator[Setup]:
    """Three robots that are plugged in."""
    made = Setup()
    yield made
    made.close()


def test_all_robots_stop_and_are_released(setup: Setup) -> None:
    """With the latch of that stop."""
    reply = setup.ask(Stop(ID))
    assert (reply.address, reply.others) == (ADDRESS, [OTHER])
    assert [robot.confirmed for robot in reply.robots] == [True] * 3
    assert all(driver.is_latched for driver in setup.drivers)
    released = setup.ask(Clear(reply.latch))
    assert released.latch == 0
    assert [robot.confirmed for robot in released.robots] == [True] * 3
    assert not any(driver.is_latched for driver in setup.drivers)


def test_a_robot_that_does_not_confirm_is_named_with_the_reason(setup: Setup) -> None:
    """One that is unplugged, and one that does not answer."""
    setup.drivers[0].lose()
    setup.drivers[2].confirms = False
    wait_until(lambda: not setup.robots[0].is_connected, "it is lost")
    reply = setup.ask(Stop(ID))
    assert [(robot.name, robot.confirmed, robot.trouble) for robot in reply.robots] == [
        ("robot0", False, "lost: fake: unplugged"),
        ("robot1", True, ""),
        ("robot2", False, "not confirmed"),
    ]


def test_a_robot_that_was_away_when_the_others_were_released_stays_held(setup: Setup) -> None:
    """And the same latch releases it later."""
    latch = setup.ask(Stop(ID)).latch
    setup.drivers[0].lose()
    wait_until(lambda: not setup.robots[0].is_connected, "it is lost")
    reply = setup.ask(Clear(latch))
    assert [robot.confirmed for robot in reply.robots] == [False, True, True]
    setup.drivers[0].open()
    assert [robot.confirmed for robot in setup.ask(Clear(latch)).robots] == [True] * 3


def test_a_release_that_is_replayed_releases_nothing(setup: Setup) -> None:
    """Every stop has a latch of its own."""
    first = setup.ask(Stop(ID)).latch
    setup.ask(Clear(first))
    assert not any(robot.confirmed for robot in setup.ask(Clear(first)).robots)
    second = setup.ask(Stop(bytes([1]) * 16)).latch
    reply = setup.ask(Clear(first))
    assert first == second or not any(robot.confirmed for robot in reply.robots)
    assert all(driver.is_latched for driver in setup.drivers)


def test_a_stop_that_is_replayed_after_its_release_stops_nobody(setup: Setup) -> None:
    """But a new one does."""
    setup.ask(Clear(setup.ask(Stop(ID)).latch))
    replayed = setup.ask(Stop(ID))
    assert replayed.latch == 0
    assert not any(robot.confirmed for robot in replayed.robots)
    assert not any(driver.is_latched for driver in setup.drivers)
    assert all(robot.confirmed for robot in setup.ask(Stop(bytes([1]) * 16)).robots)


def test_a_stop_that_is_repeated_is_the_same_stop(setup: Setup) -> None:
    """It is said once, and its latch stays."""
    latches = {setup.ask(Stop(ID)).latch for _ in range(5)}
    assert len(latches) == 1
    assert sum("EMERGENCY STOP" in line for line in setup.lines) == 1


@given(st.binary(max_size=40))
def test_noise_is_not_answered(data: bytes) -> None:
    """And stops nobody, unless it is a stop."""
    reply = StopServer([], lambda line: None).answer(data, ADDRESS, [])
    assert reply is None or data in (encode(Stop(ID)),) or b"clear" in data
