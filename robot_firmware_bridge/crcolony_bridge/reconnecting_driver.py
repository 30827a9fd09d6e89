"""What most drivers have in common: their states, the latch of the emergency stop, and how they connect again."""

import threading
import time
from abc import ABC, abstractmethod

from crcolony_bridge.driver import DriverState, Reading, RobotDescription
from crcolony_bridge.errors import DeviceError, DeviceLostError

_STOP_TRIES, _CONFIRMATION_S = 5, 0.1
_RETRY_S = (0.1, 0.2, 0.5, 1.0, 2.0)
"""Between attempts to connect to a robot that is lost."""


class ReconnectingDriver(ABC):
    """A `Driver` but for its link: subclasses connect, read, write, and confirm a stop.

    Their methods raise DeviceLostError when the robot is gone, and DeviceError where a person has to do something.
    """

    silent_after_s = 0.5
    """Without a reading for so long a robot is lost."""

    def __init__(self, description: RobotDescription) -> None:
        self._description = description
        self._state = DriverState.CLOSED
        self._trouble = ""
        self._is_stopped = False
        """Whether the robot has latched its emergency stop, as far as it has said"""
        self._is_held = False
        """Whether it was told to, and not released since"""
        self._stop_confirmed = threading.Event()
        self._reading = threading.RLock()
        self._retries = 0
        self._retry_due_s = self._received_s = 0.0

    # What a subclass has ----------------------------------------------------------------------------------------------

    @abstractmethod
    def _connect(self) -> None:
        """Connect to the robot, learn what it is, and leave it standing still."""

    @abstractmethod
    def _disconnect(self) -> None:
        """Close the link, if there is one; raises nothing."""

    @abstractmethod
    def _stand_still(self) -> None:
        """Command the wheels to stop."""

    @abstractmethod
    def _send_stop(self) -> None:
        """Tell the robot to stop and to latch that; a reading confirms it. Any thread may call this."""

    @abstractmethod
    def _send_clear(self) -> None:
        """Tell the robot to release the latch; a reading confirms it."""

    @abstractmethod
    def _read(self, timeout_s: float) -> Reading | None:
        """Wait for the newest reading for so long, None after a time-out."""

    # States -----------------------------------------------------------------------------------------------------------

    @property
    def state(self) -> DriverState:
        """See `Driver`."""
        return self._state

    @property
    def description(self) -> RobotDescription:
        """See `Driver`."""
        return self._description

    @property
    def trouble(self) -> str:
        """See `Driver`."""
        return self._trouble

    def open(self) -> None:
        """See `Driver`."""
        self._state = DriverState.CONNECTING
        try:
            self._connect()
        except (DeviceError, DeviceLostError):
            self._disconnect()
            self._state = DriverState.CLOSED
            raise
        self._become_inactive()

    def activate(self) -> None:
        """See `Driver`."""
        if self._state is DriverState.INACTIVE and not (self._is_stopped or self._is_held):
            self._state = DriverState.ACTIVE

    def deactivate(self) -> None:
        """See `Driver`."""
        if self._state is DriverState.ACTIVE:
            self._state = DriverState.INACTIVE
            try:
                self._stand_still()
            except DeviceLostError as error:
                self._lose(error)

    def stop(self) -> bool:
        """See `Driver`. Where no other thread reads, this one does."""
        self._is_held = True
        self._stop_confirmed.clear()
        if self._state is DriverState.ACTIVE:
            self._state = DriverState.INACTIVE
        for _ in range(_STOP_TRIES):
            try:
                if not self._is_connected:
                    return False
                self._send_stop()
                if self._is_stop_confirmed():
                    return True
            except DeviceLostError as error:
                self._lose(error)
                return False
        return False

    def clear(self) -> bool:
        """See `Driver`."""
        try:
            with self._reading:
                if self._is_connected:
                    self._send_clear()
                    end_s = time.monotonic() + _STOP_TRIES * _CONFIRMATION_S
                    while (left_s := end_s - time.monotonic()) > 0.0:
                        reading = self._read(left_s)
                        if reading is not None and not reading.is_stopped:
                            self._is_held = self._is_stopped = False
                            return True
        except DeviceLostError as error:
            self._lose(error)
        return False

    def close(self) -> None:
        """See `Driver`."""
        self.deactivate()
        self._disconnect()
        self._state = DriverState.CLOSED

    def read(self, timeout_s: float) -> Reading | None:
        """See `Driver`."""
        end_s = time.monotonic() + timeout_s
        while True:
            left_s = max(end_s - time.monotonic(), 0.0)
            if self._is_connected or self._is_reconnected():
                try:
                    reading = self._read_and_follow(left_s)
                    if reading is not None:
                        return reading
                except DeviceLostError as error:
                    self._lose(error)
                    continue
            if left_s == 0.0 or self._state is DriverState.CLOSED:
                return None
            if not self._is_connected:
                time.sleep(min(left_s, max(self._retry_due_s - time.monotonic(), 0.01)))

    def _read_and_follow(self, timeout_s: float) -> Reading | None:
        with self._reading:
            reading = self._read(timeout_s)
        if reading is not None:
            self._received_s = time.monotonic()
            self._follow_latch(reading.is_stopped)
        elif time.monotonic() - self._received_s > self.silent_after_s:
            raise DeviceLostError(f"silent for {self.silent_after_s:g} s")
        return reading

    def _is_stop_confirmed(self) -> bool:
        """Return whether the robot confirms a stop soon, be it read here or by another thread."""
        end_s = time.monotonic() + _CONFIRMATION_S
        while (left_s := end_s - time.monotonic()) > 0.0 and not self._stop_confirmed.is_set():
            if self._reading.acquire(blocking=False):
                try:
                    self._read_and_follow(left_s)
                finally:
                    self._reading.release()
            else:
                self._stop_confirmed.wait(left_s)
        return self._stop_confirmed.is_set()

    @property
    def _is_connected(self) -> bool:
        return self._state.is_connected

    def _become_inactive(self) -> None:
        self._state, self._received_s = DriverState.INACTIVE, time.monotonic()

    def _follow_latch(self, is_stopped: bool) -> None:
        """Follow the robot's latch: somebody may have pressed its button."""
        self._is_stopped = is_stopped
        if is_stopped:
            self._stop_confirmed.set()
            if self._state is DriverState.ACTIVE:
                self._state = DriverState.INACTIVE

    def _lose(self, error: Exception) -> None:
        self._disconnect()
        self._state, self._trouble = DriverState.LOST, str(error)
        self._retries = 0
        self._retry_due_s = time.monotonic() + self._pause_s()

    def _pause_s(self) -> float:
        """Return how long to wait before connecting again; `_retries` attempts have failed since the loss."""
        return _RETRY_S[min(self._retries, len(_RETRY_S) - 1)]

    def _is_reconnected(self) -> bool:
        """Connect again if that is due; the robot is INACTIVE then, and never moves by itself."""
        now_s = time.monotonic()
        if self._state not in (DriverState.LOST, DriverState.FAULT) or now_s < self._retry_due_s:
            return False
        self._state = DriverState.CONNECTING
        try:
            self._connect()
        except (DeviceError, DeviceLostError) as error:
            self._disconnect()
            is_lost = isinstance(error, DeviceLostError)
            self._state = DriverState.LOST if is_lost else DriverState.FAULT
            self._trouble = str(error)
            self._retries += 1
            self._retry_due_s = time.monotonic() + self._pause_s()
            return False
        self._become_inactive()
        return True
