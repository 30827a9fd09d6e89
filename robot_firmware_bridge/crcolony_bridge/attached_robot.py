"""A robot that is attached to this machine, driven on a thread of its own: a device may make its reader wait.

The thread writes the newest action and reads the newest reading. It never repeats an action: wheels turn for as long as
the one who drives keeps sending.
"""

import enum
import threading
from collections.abc import Callable
from concurrent.futures import Future

from crcolony.compiled import FloatArray
from crcolony_bridge.driver import Driver, DriverState, Reading
from crcolony_bridge.errors import DeviceError, DeviceLostError
from crcolony_bridge.watchdog_rule import check_watchdog

_READ_TIMEOUT_S = 0.05
_OPEN_RETRY_S = 1.0
_CLEAR_TIMEOUT_S = 1.0
_MAX_IR_MESSAGES = 32
"""Infrared messages that wait for the next control period."""


class _Battery(enum.Enum):
    """What a robot says of its battery, and what follows from that."""

    GOOD = "battery charged"
    LOW = "battery low: it meets nobody until it is charged"
    CRITICAL = "battery critical: it stands still until it is charged"


class AttachedRobot:
    """Runs a driver from `start` to `close`. `name` is what a person calls the robot.

    `print_line` receives, on the thread, what a person should read. Without `needs_watchdog` a robot is accepted whose
    wheels turn on when this machine dies.
    """

    def __init__(
        self,
        name: str,
        driver: Driver,
        print_line: Callable[[str], None],
        *,
        needs_watchdog: bool = True,
    ) -> None:
        self.name, self._needs_watchdog = name, needs_watchdog
        self._driver, self._print_line = driver, print_line
        self._mutex = threading.Lock()
        self._reading: Reading | None = None
        self._ir_messages: list[bytes] = []
        self._action: FloatArray | None = None
        self._beacon: bytes | None = None
        self._is_driven = self._is_held = False
        self._clearing: Future[bool] | None = None
        self._battery = _Battery.GOOD
        self._is_closed = threading.Event()
        self._shown = ""
        self._thread = threading.Thread(target=self._run, name=f"robot {name}", daemon=True)

    def open(self) -> None:
        """Connect; a robot that is not there yet may come later. Raises DeviceError if a person has to do something."""
        try:
            self._open_driver()
        except DeviceLostError as error:
            self._show(f"waits for it: {error}")

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def close(self) -> None:
        """Stand still and disconnect."""
        self._is_closed.set()
        if self._thread.is_alive():
            self._thread.join()
        self._driver.close()

    @property
    def driver(self) -> Driver:
        """The driver, for its state and description, and for `stop`."""
        return self._driver

    @property
    def is_connected(self) -> bool:
        """Whether the robot is there."""
        return self._driver.state.is_connected

    @property
    def may_meet(self) -> bool:
        """Whether its battery is good enough to mate: offspring of a robot that fails could not live."""
        return self._battery is _Battery.GOOD

    @property
    def is_exhausted(self) -> bool:
        """Whether its battery is critical: it stands still, and who lives in it rests until it is charged."""
        return self._battery is _Battery.CRITICAL

    @property
    def count(self) -> int:
        """How many bodies it is, for an emergency stop."""
        return 1

    def why_not(self) -> str:
        """Return why the robot is out of reach, "" if it is not."""
        return "" if self.is_connected else f"{self._driver.state.value}: {self._driver.trouble}"

    def why_unusable(self) -> str:
        """Return why it can be nobody's body at present, "" if it can."""
        if not self.is_connected:
            return "not connected"
        return "battery critical" if self.is_exhausted else ""

    def hold(self) -> bool:
        """Stop at once, and stay so until `release`; return whether the robot has confirmed. For any thread."""
        with self._mutex:
            self._is_held = True
        return self._driver.stop()

    def release(self) -> bool:
        """Allow motion again; return whether the robot has confirmed. For any thread but its own."""
        clearing: Future[bool] = Future()
        with self._mutex:
            self._clearing = clearing
        try:
            return clearing.result(_CLEAR_TIMEOUT_S)
        except TimeoutError:
            return False

    def drive(self, is_driven: bool) -> None:
        """Say whether somebody has this robot for a body: without, it stands still."""
        with self._mutex:
            self._is_driven = is_driven
            self._action = None

    def act(self, action: FloatArray) -> None:
        """Carry out an action as soon as possible; one that waits is replaced."""
        with self._mutex:
            self._action = action

    def load_beacon(self, message: bytes) -> None:
        """Let the robot's beacon repeat this message from now on."""
        with self._mutex:
            self._beacon = message

    def take(self) -> tuple[Reading | None, list[bytes]]:
        """Return the newest reading and all infrared messages since the last call."""
        with self._mutex:
            taken = self._reading, self._ir_messages
            self._reading, self._ir_messages = None, []
        return taken

    def _run(self) -> None:
        while not self._is_closed.is_set():
            if self._driver.state is DriverState.CLOSED:
                self._open_again()
                continue
            reading = self._driver.read(_READ_TIMEOUT_S)
            self._show_state()
            if reading is not None:
                self._follow_battery(reading)
            with self._mutex:
                if reading is not None:
                    self._reading = reading
                    self._ir_messages += reading.ir_messages
                    del self._ir_messages[:-_MAX_IR_MESSAGES]
                action, self._action = self._action, None
                beacon, self._beacon = self._beacon, None
                clearing, self._clearing = self._clearing, None
            if clearing is not None:
                self._clear(clearing)
            self._write(action, beacon)

    def _follow_battery(self, reading: Reading) -> None:
        before = self._battery
        if reading.is_battery_critical:
            self._battery = _Battery.CRITICAL
        elif reading.is_battery_low:
            self._battery = _Battery.LOW
        else:
            self._battery = _Battery.GOOD
        if self._battery is not before:
            self._print_line(f"{self.name}: {self._battery.value}")

    def _clear(self, clearing: "Future[bool]") -> None:
        is_cleared = self._driver.clear()
        with self._mutex:
            self._is_held = self._is_held and not is_cleared
        clearing.set_result(is_cleared)

    def _write(self, action: FloatArray | None, beacon: bytes | None) -> None:
        with self._mutex:
            may_move = self._is_driven and not (self._is_held or self.is_exhausted)
        if not may_move:
            self._driver.deactivate()
            return
        if action is not None:
            self._driver.activate()  # after a loss, too: who drives has sent an action since
            self._driver.write(action)
        if beacon is not None and not self._driver.send_ir(beacon):
            with self._mutex:
                self._beacon = self._beacon or beacon

    def _open_driver(self) -> None:
        """Connect; what a robot is, one that was plugged in later too, is known only then."""
        self._driver.open()
        try:
            described = self._driver.description
            check_watchdog(self.name, described, is_needed=self._needs_watchdog)
        except DeviceError:
            self._driver.close()
            raise

    def _open_again(self) -> None:
        try:
            self._open_driver()
        except (DeviceError, DeviceLostError) as error:
            self._show(f"waits for it: {error}")
            self._is_closed.wait(_OPEN_RETRY_S)

    def _show_state(self) -> None:
        state, trouble = self._driver.state, self._driver.trouble
        if state in (DriverState.LOST, DriverState.FAULT):
            self._show(f"{state.value}: {trouble}")
        elif self.is_connected:
            self._show("connected")

    def _show(self, what: str) -> None:
        """Print what has changed, once."""
        if what != self._shown:
            self._shown = what
            self._print_line(f"{self.name}: {what}")
