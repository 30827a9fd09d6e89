"""A driver as a `Body`: to drive a robot by hand, and to run the contract test of bodies on it."""

import time

from crcolony.compiled import FloatArray
from crcolony_bridge.driver import Driver, DriverState, Reading
from crcolony_bridge.errors import DeviceLostError


class DriverBody:
    """Drives an open robot with a control period. `read` and `act` raise DeviceLostError if it is lost."""

    def __init__(self, driver: Driver, period_s: float = 0.1) -> None:
        self._driver, self._period_s = driver, period_s
        self._due_s = time.monotonic()
        self._reading: Reading | None = None
        driver.activate()

    @property
    def reading(self) -> Reading | None:
        """The last reading, with all that an observation does not show."""
        return self._reading

    def read(self) -> FloatArray:
        """Wait for the next control period; return what was measured last (OBSERVATION_WIDTH,)."""
        now_s = time.monotonic()
        self._due_s = max(self._due_s + self._period_s, now_s)
        while (left_s := self._due_s - time.monotonic()) > 0.0 or self._reading is None:
            self._reading = self._driver.read(max(left_s, 0.01)) or self._reading
            self._check()
        return self._reading.row.copy()

    def act(self, action: FloatArray) -> FloatArray:
        """Write an action; see `Body`."""
        self._check()
        return self._driver.write(action)

    def close(self) -> None:
        """Stand still and disconnect."""
        self._driver.close()

    def _check(self) -> None:
        if self._driver.state in (DriverState.LOST, DriverState.FAULT, DriverState.CLOSED):
            raise DeviceLostError(self._driver.trouble or "the driver is closed")
