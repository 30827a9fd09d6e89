"""What becomes of an Aseba robot when something fails: it is LOST, comes back INACTIVE, and never moves by itself."""

import os
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from crcolony_bridge.aseba.driver import CONTENDED_RETRY_S, AsebaRobot
from crcolony_bridge.aseba.program import ProgramVariables
from crcolony_bridge.aseba.protocol import AsebaMessage, AsebaType, encode_message, request
from crcolony_bridge.aseba.session import AsebaSession
from crcolony_bridge.driver import DriverState
from crcolony_bridge.errors import DeviceError, DeviceLostError
from crcolony_bridge.link import Link, open_link

from tests.robot_firmware_bridge.aseba.driven import (
    NewRobot,
    drive,
    read_for,
    turns,
    wait_for_state,
)
from tests.robot_firmware_bridge.driving import read_until
from tests.robot_firmware_bridge.playground import (
    PlacedRobot,
    Playground,
    free_port,
    needs_playground,
    needs_socat,
    playground,
    wait_for_port,
)
from tests.support.process import wait_until

pytestmark = needs_playground


class TamperedLink:
    """A link to which a test adds bytes in either direction."""

    def __init__(self, address: str, baud: int) -> None:
        self._link = open_link(address, baud)
        self.garbage = b""

    def read(self, timeout_s: float) -> bytes:
        """Return the garbage, or else what arrives."""
        garbage, self.garbage = self.garbage, b""
        return garbage or self._link.read(timeout_s)

    def write(self, data: bytes) -> None:
        """Send."""
        self._link.write(data)

    def close(self) -> None:
        """Close it."""
        self._link.close()


class Connections:
    """Opens links and keeps them all."""

    def __init__(self) -> None:
        self.links: list[TamperedLink] = []

    def open(self, address: str, baud: int) -> Link:
        """Open one more."""
        self.links.append(TamperedLink(address, baud))
        return self.links[-1]


def stands_still_until_activated(robot: AsebaRobot) -> None:
    """Commands do nothing before it is activated; then they move it."""
    assert robot.state is DriverState.INACTIVE
    assert (robot.write(drive())[:2] == 0.0).all()
    assert not any(turns(reading) for reading in read_for(robot, 0.15))
    robot.activate()
    robot.write(drive())
    read_until(robot, turns)


def test_a_simulator_that_is_killed_and_restarted(world: Playground, driver: AsebaRobot) -> None:
    """LOST at once with the reason, reading and writing go on without a robot; a stop stays latched meanwhile."""
    driver.write(drive())
    read_until(driver, turns)
    world.end()
    assert wait_for_state(driver, DriverState.LOST) < 0.2
    assert "tcp:127.0.0.1:" in driver.trouble
    assert (driver.write(drive())[:2] == 0.0).all()
    assert driver.read(0.02) is None
    assert not driver.stop()
    assert not driver.clear()
    world.start()
    wait_for_state(driver, DriverState.INACTIVE)
    assert read_until(driver, lambda reading: True).is_stopped
    driver.activate()
    assert driver.state is DriverState.INACTIVE
    assert driver.clear()
    stands_still_until_activated(driver)


def test_a_second_controller_is_noticed_and_not_fought(
    placed: PlacedRobot, driver: AsebaRobot, new_robot: NewRobot
) -> None:
    """The last client wins. Two of our drivers leave each other in peace for longer and longer."""
    connections = Connections()
    rival = new_robot(placed.address, placed.uid, connections.open)
    ended = threading.Event()

    def compete() -> None:
        rival.open()
        while not ended.is_set():
            rival.read(0.05)

    competing = threading.Thread(target=compete)
    competing.start()
    wait_for_state(driver, DriverState.LOST)
    assert driver.trouble.endswith("off, or taken by another controller")
    first_s = wait_for_state(driver, DriverState.INACTIVE)
    assert first_s >= CONTENDED_RETRY_S[0]
    wait_for_state(driver, DriverState.LOST)
    read_for(driver, 0.5)
    assert driver.state is DriverState.LOST
    ended.set()
    competing.join()
    assert len(connections.links) == 2
    assert rival.state is DriverState.INACTIVE


def test_garbage_in_the_stream_is_a_loss_and_no_crash_and_so_is_silence(
    placed: PlacedRobot, world: Playground, new_robot: NewRobot
) -> None:
    """A stream with garbage is begun anew; a robot that says nothing is lost though its connection stays."""
    connections = Connections()
    robot = new_robot(placed.address, placed.uid, connections.open)
    robot.open()
    connections.links[0].garbage = b"\xff" * 40
    wait_for_state(robot, DriverState.LOST)
    assert "no stream of Aseba's" in robot.trouble
    wait_for_state(robot, DriverState.INACTIVE)
    stands_still_until_activated(robot)
    world.freeze()
    assert wait_for_state(robot, DriverState.LOST) < 1.5
    assert robot.trouble == "silent for 1 s"


def test_what_a_robot_says_when_it_is_ours_no_more(placed: PlacedRobot, world: Playground) -> None:
    """It has left, it was reset by somebody who shares the line, its readings are not those of our program."""
    link = TamperedLink(placed.address, 0)
    session = AsebaSession(link, placed.address)
    session.start("", is_stopped=False)
    for message, said in (
        (AsebaMessage(AsebaType.DISCONNECTED, b"", 1), "it has left"),
        (AsebaMessage(AsebaType.EXECUTION_STATE, bytes(4), 1), "another controller has reset"),
        (AsebaMessage(AsebaType.DIVISION_BY_ZERO, bytes(2), 1), "its program has failed"),
        (AsebaMessage(0, bytes(2), 1), "runs another program"),
        (AsebaMessage(0, bytes(2 * (194 + ProgramVariables.WORDS)), 1), "was reset"),
    ):
        link.garbage = encode_message(message)
        with pytest.raises(DeviceLostError, match=said):
            session.read(0.2)
    link.garbage = encode_message(AsebaMessage(AsebaType.DISCONNECTED, b"", 2))  # of another robot
    assert session.read(0.2) is not None
    for type_ in (AsebaType.RESET, AsebaType.RUN):
        link.write(encode_message(request(type_, 1)))
    with pytest.raises(DeviceLostError, match="another controller has reset or stopped"):
        session.read(1.0)
    session.close()


def test_what_is_no_aseba_robot_is_said() -> None:
    """Nobody who listens, a terminal where nobody answers, an address that is none."""
    with pytest.raises(DeviceLostError, match="refused"):
        AsebaRobot(f"tcp:127.0.0.1:{free_port()}").open()
    leader, follower = os.openpty()
    robot = AsebaRobot(os.ttyname(follower))
    with pytest.raises(DeviceError, match="no Aseba node answers; check that"):
        robot.open()
    assert robot.state is DriverState.CLOSED
    os.close(leader)
    os.close(follower)
    with pytest.raises(DeviceError, match="expected tcp:HOST:PORT"):
        AsebaRobot("tcp:here").open()


@contextmanager
def running(*command: str) -> Iterator[None]:
    """Run a program inside the context."""
    process = subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        yield
    finally:
        process.terminate()
        process.wait()


@needs_socat
def test_a_robot_on_a_serial_line_that_is_pulled_and_put_back(
    placed: PlacedRobot, world: Playground, new_robot: NewRobot, tmp_path: Path
) -> None:
    """The same over a serial device: LOST at once, and INACTIVE when it is back."""
    device = tmp_path / "tty"

    line = ("socat", f"PTY,link={device},raw,echo=0", f"TCP:127.0.0.1:{placed.port},nodelay")
    robot = new_robot(str(device))
    with running(*line):
        wait_until(device.exists, "the serial device")
        robot.open()
        stands_still_until_activated(robot)
        with pytest.raises(DeviceError, match="another program uses it"):
            AsebaRobot(str(device)).open()
    assert wait_for_state(robot, DriverState.LOST) < 0.2
    assert robot.read(0.02) is None
    with running(*line):
        wait_for_state(robot, DriverState.INACTIVE)
        assert (robot.write(drive())[:2] == 0.0).all()


def test_of_several_robots_behind_a_switch_one_is_driven(new_robot: NewRobot) -> None:
    """Which one the uid says; the other one does not move."""
    e_puck = PlacedRobot("e-puck", 100.0, 100.0, free_port(), node=1)
    thymio = PlacedRobot("thymio2", 200.0, 100.0, free_port(), node=2)
    port = free_port()
    with playground([e_puck, thymio]):
        targets = [f"tcp:127.0.0.1;{robot.port}" for robot in (e_puck, thymio)]
        with running("asebaswitch", "-p", str(port), *targets):
            wait_for_port(port)
            with pytest.raises(DeviceError, match="nodes 1, 2 are there; give the uid of one"):
                AsebaRobot(f"tcp:127.0.0.1:{port}").open()
            robot, other = (
                new_robot(f"tcp:127.0.0.1:{port}", uid) for uid in ("e-puck-1", "thymio-2")
            )
            robot.open()
            other.open()
            other.activate()
            stands_still_until_activated(robot)
            assert not any(turns(reading) for reading in read_for(other, 0.25))
