"""A driver of a robot that is a few numbers: its wheels are what was written, its readings what a test gives it."""

import threading
from queue import Empty, Queue

import numpy as np
from crcolony_bridge.attached_robot import AttachedRobot
from crcolony_bridge.driver import DriverState, Reading, RobotDescription, limited_action
from crcolony_bridge.errors import DeviceError, DeviceLostError

from crcolony.body import contract
from crcolony.compiled import FloatArray


class FakeDriver:
    """A `Driver` for tests of what uses drivers; drivers themselves are tested on real firmware."""

    def __init__(self, *, is_present: bool = True) -> None:
        self.state = DriverState.CLOSED
        self.description = RobotDescription(
            "fake",
            "0001",
            proximity_bearings_rad=(0.0,),
            battery_full_v=4.0,
            battery_empty_v=3.0,
            watchdog="firmware",
            watchdog_s=0.5,
        )
        self.trouble = ""
        self.is_present, self.is_latched, self.confirms = is_present, False, True
        self.written: list[FloatArray] = []
        self.beacons: list[bytes] = []
        self.readings: Queue[Reading] = Queue()
        self.changed = threading.Condition()

    def open(self) -> None:
        """Connect, if it is present."""
        if not self.is_present:
            raise DeviceLostError("fake: not plugged in")
        self.state = DriverState.INACTIVE

    def lose(self) -> None:
        """Unplug it."""
        self.state, self.trouble = DriverState.LOST, "fake: unplugged"

    def activate(self) -> None:
        """Allow motion, unless it is latched."""
        if self.state is DriverState.INACTIVE and not self.is_latched:
            self._set(DriverState.ACTIVE)

    def deactivate(self) -> None:
        """Stand still."""
        if self.state is DriverState.ACTIVE:
            self._set(DriverState.INACTIVE)

    def read(self, timeout_s: float) -> Reading | None:
        """Return the next reading that a test has put."""
        try:
            return self.readings.get(timeout=timeout_s)
        except Empty:
            return None

    def write(self, action: FloatArray) -> FloatArray:
        """Remember an action."""
        is_active = self.state is DriverState.ACTIVE
        applied = limited_action(action, self.description, 0.5, may_move=is_active)
        with self.changed:
            self.written.append(applied)
            self.changed.notify_all()
        return applied

    def stop(self) -> bool:
        """Latch."""
        self.is_latched = True
        self.deactivate()
        return self.confirms and self.state is not DriverState.LOST

    def clear(self) -> bool:
        """Release the latch."""
        if self.state is DriverState.LOST:
            return False
        self.is_latched = False
        return True

    def send_ir(self, message: bytes) -> bool:
        """Remember a message."""
        with self.changed:
            self.beacons.append(message)
            self.changed.notify_all()
        return True

    def close(self) -> None:
        """Disconnect."""
        self._set(DriverState.CLOSED)

    def _set(self, state: DriverState) -> None:
        with self.changed:
            self.state = state
            self.changed.notify_all()


class BrokenDriver(FakeDriver):
    """A driver that needs a person."""

    def open(self) -> None:
        """Refuse."""
        raise DeviceError("fake: permission denied")


class AttachedFakes:
    """So many robots that are plugged in and driven, and the lines that they print."""

    def __init__(self, count: int) -> None:
        self.drivers = [FakeDriver() for _ in range(count)]
        self.lines: list[str] = []
        self.robots = [
            AttachedRobot(f"robot{k}", driver, self.lines.append)
            for k, driver in enumerate(self.drivers)
        ]
        for robot in self.robots:
            robot.open()
            robot.start()

    def close(self) -> None:
        """Unplug them."""
        for robot in self.robots:
            robot.close()


def reading(battery: float = 0.5, *heard: bytes) -> Reading:
    """Return a reading of a robot with nothing around it."""
    row = np.zeros(contract.OBSERVATION_WIDTH)
    row[contract.ENCOUNTER_ROBOT] = -1.0
    row[contract.BATTERY] = battery
    return Reading(0.0, row, ir_messages=heard)
