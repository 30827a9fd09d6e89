"""ROS 2 bases are driven: a simulated one, in its own process, that shares no line of code with the driver."""

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec

import pytest
from crcolony_bridge.driver import Driver, DriverState
from crcolony_bridge.driver_contract_test import DriverContract
from crcolony_bridge.errors import DeviceError, DeviceLostError
from crcolony_bridge.ros2.cdr import encode
from crcolony_bridge.ros2.driver import Ros2Robot
from crcolony_bridge.ros2.keys import TWIST, Node, attachment, topic_key
from crcolony_bridge.ros2.messages import Twist, Vector3
from crcolony_bridge.ros2.session import Ros2Session

from crcolony.body import contract
from crcolony.compiled import FloatArray
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import open_session
from tests.robot_firmware_bridge.aseba.driven import (
    drive,
    read_for,
    turns,
    wait_for_state,
)
from tests.robot_firmware_bridge.driving import read_until
from tests.robot_firmware_bridge.playground import free_port
from tests.robot_firmware_bridge.ros2.network import Network, Program

NewRobot = Callable[[str], Ros2Robot]
LATE_S = 0.25
"""What a busy machine may be late by."""
WITHOUT = [contract.JAW, *range(contract.LED, contract.LED + 3), contract.SPEAKER, contract.BEACON]


class TestContract(DriverContract):
    """The promises of all drivers."""

    period_s = 0.1
    observations = 12

    @pytest.fixture(autouse=True)
    def _shared(self, shared: Network) -> None:
        self.address = shared.address

    def new_driver(self) -> Driver:
        """Return a driver of the base that all tests share."""
        return Ros2Robot(self.address)

    def highest_action(self) -> FloatArray:
        """These robots have nothing but wheels."""
        highest = super().highest_action()
        highest[WITHOUT] = 0.0
        return highest


@contextmanager
def repeated(action: Callable[[], None], period_s: float) -> Iterator[None]:
    """Do something again and again inside the context."""
    ended = threading.Event()

    def repeat() -> None:
        while not ended.wait(period_s):
            action()

    thread = threading.Thread(target=repeat)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def stands_still_until_activated(robot: Ros2Robot) -> None:
    """Commands do nothing before it is activated; then they move it."""
    assert robot.state is DriverState.INACTIVE
    assert (robot.write(drive())[:2] == 0.0).all()
    assert not any(turns(reading) for reading in read_for(robot, 0.2))
    robot.activate()
    robot.write(drive())
    read_until(robot, turns)


def test_a_robot_says_what_it_is_and_measures(shared: Network, driver: Ros2Robot) -> None:
    """Whose watchdog it is, a wall to the left, a sensor's distance, and the battery."""
    robot = driver.description
    assert (robot.model, robot.uid) == ("Create 3 (ROS 2)", "robot1")
    assert (robot.watchdog, robot.watchdog_s, robot.ir) == ("robot's own base", 0.5, "none")
    shared.base.tell("wall 30 0.4")
    reading = read_until(driver, lambda reading: bool(reading.row[contract.PROXIMITY + 4] < 0.3))
    proximity_m = reading.row[contract.PROXIMITY : contract.PROXIMITY + 7]
    assert proximity_m == pytest.approx([0.3, 0.3, 0.3, 0.3, 0.23, 0.123, 0.3], abs=1e-6)
    assert reading.row[contract.BATTERY] == pytest.approx(0.8)
    assert reading.battery_v == pytest.approx(14.4)
    assert not reading.is_battery_low
    assert 0.0 <= reading.time_s < 5.0
    shared.base.tell("battery 0.04")
    assert read_until(driver, lambda reading: reading.is_battery_critical).is_battery_low
    shared.base.tell("battery 0.8")
    shared.base.tell("wall 0 9")


def test_a_base_turns_as_it_is_told(shared: Network, driver: Ros2Robot) -> None:
    """Both wheels; where one would have to be faster than it can, both are slower, and the curve is the same."""
    seen = len(shared.base.lines)
    assert driver.write(drive(0.5, 0.2, -0.1))[:2].tolist() == [0.2, -0.1]
    shared.base.wait_for(r"wheels 0\.2000 -0\.1000", since=seen)
    assert driver.write(drive(0.5, 1.0, -0.5))[:2].tolist() == pytest.approx([0.306, -0.153])
    shared.base.wait_for(r"wheels 0\.3060 -0\.1530", since=seen)
    reading = read_until(driver, turns)
    assert reading.row[contract.GYRO] < 0.0


@pytest.mark.parametrize("ttl_s", [0.1, 0.3])
def test_without_a_fresh_command_this_process_stops_the_base(
    shared: Network, driver: Ros2Robot, ttl_s: float
) -> None:
    """When the time to live is over, before the base's own watchdog."""
    seen = len(shared.base.lines)
    driver.write(drive(ttl_s))
    started_s = shared.started_s(since=seen)
    assert ttl_s - 0.05 <= shared.stopped_s("commanded", since=seen) - started_s <= ttl_s + LATE_S


@pytest.mark.parametrize("end", [Ros2Robot.deactivate, Ros2Robot.close])
def test_a_robot_that_is_left_is_told_to_stand_still(
    shared: Network, driver: Ros2Robot, end: Callable[[Ros2Robot], None]
) -> None:
    """At once, not when its watchdog acts."""
    seen = len(shared.base.lines)
    driver.write(drive(0.5))
    shared.started_s(since=seen)
    ended_s = time.monotonic()
    end(driver)
    assert shared.stopped_s("commanded", since=seen) - ended_s <= LATE_S


def test_a_base_that_wants_stamped_commands_gets_them(shared: Network, new_robot: NewRobot) -> None:
    """As its liveliness token says: newer robots take TwistStamped."""
    base = Program("simulated_base", shared.endpoint, "robot2", "TwistStamped")
    try:
        robot = new_robot(f"{shared.endpoint}/robot2")
        robot.open()
        stands_still_until_activated(robot)
        assert robot.stop()
    finally:
        base.kill()


@pytest.mark.skipif(find_spec("zenoh_ros2_sdk") is None, reason="pip install zenoh-ros2-sdk")
def test_a_base_on_code_of_others_is_driven(shared: Network, new_robot: NewRobot) -> None:
    """With the SDK of ROBOTIS at the other end: found, moved, observed, and stopped."""
    base = Program("sdk_base", shared.endpoint, "robot3")
    try:
        robot = new_robot(f"{shared.endpoint}/robot3")
        robot.open()
        robot.activate()
        robot.write(drive(0.3, 0.1, 0.2))
        base.wait_for(r"wheels 0\.1500 0\.4292")
        read_until(robot, turns)
        assert robot.stop()
        base.wait_for("wheels 0.0000 0.0000", since=1)
    finally:
        base.kill()
    wait_for_state(robot, DriverState.LOST)


def test_a_frozen_or_dead_process_leaves_the_base_to_its_watchdog(shared: Network) -> None:
    """It stops within half a second of the last command, by itself; frozen first, then killed."""
    for end in (signal.SIGSTOP, signal.SIGKILL):
        seen = len(shared.base.lines)
        driving = Program("driving_process", shared.address, "0.5")
        try:
            shared.started_s(since=seen)
            driving.wait_for("commanded")
            driving.signal(end)
            ended_s = time.monotonic()
            stopped_s = shared.stopped_s("watchdog", since=seen)
        finally:
            driving.kill()
        assert 0.3 <= stopped_s - ended_s <= 0.5 + LATE_S


def test_a_stop_is_not_confirmed_while_another_controller_drives(
    shared: Network, driver: Ros2Robot
) -> None:
    """It is latched all the same, and confirmed when that one has gone."""
    session = open_session(NetworkSettings(role="client", connect=(shared.endpoint,)))
    publisher = session.declare_publisher(topic_key(0, "/robot1/cmd_vel", TWIST))
    twist, beside = encode(Twist(Vector3(x=0.2))), attachment(1, 0, bytes(16))
    with repeated(lambda: publisher.put(twist, attachment=beside), period_s=0.005):
        read_until(driver, turns)
        assert not driver.stop()
    session.close()  # type: ignore[no-untyped-call]
    assert driver.state is DriverState.INACTIVE
    driver.activate()
    assert driver.state is DriverState.INACTIVE
    assert driver.stop()
    assert not turns(read_until(driver, lambda reading: reading.is_stopped))


def test_malformed_messages_are_passed_over(shared: Network, driver: Ros2Robot) -> None:
    """Odometry that is cut off, too long, empty or random: the next good one counts."""
    shared.base.tell("garbage")
    assert len(read_for(driver, 0.3)) >= 5
    assert driver.state is DriverState.ACTIVE


def test_what_is_not_there_is_said(
    shared: Network, new_robot: NewRobot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No router; another robot; another ROS domain. Each may come by itself."""
    monkeypatch.setattr("crcolony_bridge.ros2.driver.CONNECT_TIMEOUT_S", 0.2)
    for address, reason in (
        (f"tcp/127.0.0.1:{free_port()}/robot1", "no router answers"),
        (f"{shared.endpoint}/robot9", "nobody subscribes to /robot9/cmd_vel; there are /robot1/cm"),
        (f"{shared.address}?domain=5", "ROS_DOMAIN_ID 5"),
    ):
        robot = new_robot(address)
        with pytest.raises(DeviceLostError, match=reason):
            robot.open()
        assert robot.state is DriverState.CLOSED


def test_a_session_that_is_closed_says_so(shared: Network) -> None:
    """With the one error that drivers know; what is still published is dropped."""
    session = Ros2Session(shared.endpoint, 0, "/robot1")
    publisher = session.publisher("/robot1/other", TWIST)
    session.close()
    publisher.put(Twist())
    with pytest.raises(DeviceLostError, match=shared.endpoint):
        session.publisher("/robot1/cmd_vel", TWIST)
    with pytest.raises(DeviceLostError, match=shared.endpoint):
        session.subscribe("/robot1/cmd_vel", TWIST, Twist)


def test_a_robot_of_another_kind_is_refused(shared: Network, new_robot: NewRobot) -> None:
    """One whose commands are not Twist, or are another version of it."""
    session = open_session(NetworkSettings(role="client", connect=(shared.endpoint,)))
    node = Node(0, "1", "other", "/boat")
    wanted = node.endpoint_token(1, "MS", "/boat/cmd_vel", TWIST).replace("RIHS01_9c", "RIHS01_00")
    token = session.liveliness().declare_token(wanted)
    with pytest.raises(DeviceError, match="not Twist or TwistStamped of ROS 2 Jazzy"):
        new_robot(f"{shared.endpoint}/boat").open()
    token.undeclare()  # type: ignore[no-untyped-call]
    session.close()  # type: ignore[no-untyped-call]


def test_a_base_that_is_killed_and_restarted(shared: Network, new_robot: NewRobot) -> None:
    """LOST at once; a stop stays latched meanwhile, and nothing moves by itself."""
    robot = new_robot(shared.address)
    robot.open()
    robot.activate()
    robot.write(drive())
    shared.base.kill()
    lost_s = wait_for_state(robot, DriverState.LOST)
    assert (robot.write(drive())[:2] == 0.0).all()
    assert robot.read(0.02) is None
    assert not robot.stop()
    assert not robot.clear()
    shared.base.start()
    assert lost_s < 0.4
    wait_for_state(robot, DriverState.INACTIVE)
    read_until(robot, lambda reading: reading.is_stopped)
    robot.activate()
    assert robot.state is DriverState.INACTIVE
    assert robot.clear()
    stands_still_until_activated(robot)


def test_a_base_whose_odometry_falls_silent(shared: Network, driver: Ros2Robot) -> None:
    """It is LOST after half a second, and INACTIVE when it says again how it moves."""
    shared.base.tell("silent 1")
    lost_s = wait_for_state(driver, DriverState.LOST)
    assert driver.trouble == "silent for 0.5 s"
    shared.base.tell("silent 0")
    assert 0.4 <= lost_s <= 0.5 + 2 * LATE_S
    wait_for_state(driver, DriverState.INACTIVE)


def test_a_router_that_is_restarted(shared: Network, driver: Ros2Robot) -> None:
    """LOST with the reason, and INACTIVE when the robot is back; the base has stopped meanwhile."""
    seen = len(shared.base.lines)
    driver.write(drive(0.5))
    shared.started_s(since=seen)
    shared.router.kill()
    wait_for_state(driver, DriverState.LOST)
    shared.stopped_s("watchdog", since=seen)
    read_for(driver, 0.1)
    trouble = driver.trouble
    shared.router.start()
    assert "no router answers" in trouble
    wait_for_state(driver, DriverState.INACTIVE)
    stands_still_until_activated(driver)
