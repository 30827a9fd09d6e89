"""A simulated robot whose wheels turn faster and slower than commanded, with a gyro that has a bias."""

import time

import numpy as np
from crcolony_bridge.driver import DriverState, Reading, RobotDescription, limited_action
from crcolony_bridge.reconnecting_driver import ReconnectingDriver

from crcolony.body import contract
from crcolony.compiled import FloatArray

TRACK_M, SCALES, BIAS_RAD_S = 0.12, (0.9, 1.1), 0.02


class SkewedRobot(ReconnectingDriver):
    """It reports how its wheels really turn, as encoders do. Without a gyro it reports 0."""

    def __init__(self, *, has_gyro: bool = True) -> None:
        super().__init__(RobotDescription("skewed", "skewed/1", track_m=0.16, max_speed_m_s=0.3))
        self._has_gyro = has_gyro
        self._wheels, self._until_s, self._is_latched = (0.0, 0.0), 0.0, False

    def write(self, action: FloatArray) -> FloatArray:
        """Turn the wheels."""
        may_move = self.state is DriverState.ACTIVE
        applied = limited_action(action, self.description, 0.5, may_move=may_move)
        left, right = applied[[contract.WHEEL_LEFT, contract.WHEEL_RIGHT]]
        self._wheels = left * SCALES[0], right * SCALES[1]
        self._until_s = time.monotonic() + applied[contract.TTL]
        return applied

    def send_ir(self, message: bytes) -> bool:
        """It has no infrared."""
        return False

    def _connect(self) -> None:
        self._stand_still()

    def _disconnect(self) -> None:
        pass

    def _stand_still(self) -> None:
        self._wheels = 0.0, 0.0

    def _send_stop(self) -> None:
        self._is_latched = True

    def _send_clear(self) -> None:
        self._is_latched = False

    def _read(self, timeout_s: float) -> Reading | None:
        time.sleep(min(timeout_s, 0.01))
        moves = time.monotonic() < self._until_s and not self._is_latched
        left, right = self._wheels if moves else (0.0, 0.0)
        row = np.zeros(contract.OBSERVATION_WIDTH)
        row[contract.ENCOUNTER_ROBOT] = -1.0
        row[contract.WHEELS], row[contract.WHEELS + 1] = left, right
        if self._has_gyro:
            row[contract.GYRO] = (right - left) / TRACK_M + BIAS_RAD_S
        return Reading(time.monotonic(), row, 3.5, is_stopped=self._is_latched)
