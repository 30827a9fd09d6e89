"""A robot on the bench: what it is and measures, driving it by hand, and calibrating it."""

import statistics
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec
import numpy as np

from crcolony.body import contract
from crcolony.compiled import FloatArray
from crcolony_bridge.calibration import Calibration
from crcolony_bridge.driver import Driver, Reading, RobotDescription
from crcolony_bridge.driver_body import DriverBody
from crcolony_bridge.errors import DeviceError, DeviceLostError
from crcolony_bridge.watchdog_rule import check_watchdog

PERIOD_S = 0.1
_TTL_S = 0.3
_PROBE_S = 1.0
_STILL_S, _AHEAD_S, _TURN_S = 1.0, 1.5, 3.0
_STEADY = 5
"""Readings at the begin of a motion that are left out: wheels have to speed up."""
_LEAST_TURN_RAD_S = 0.05
"""A gyro that reports less while the robot turns is none."""
_WHEELS = slice(contract.WHEELS, contract.WHEELS + 2)


@contextmanager
def opened(driver: Driver, *, needs_watchdog: bool) -> Iterator[Driver]:
    """Have a robot open inside the context.

    Raises DeviceError if it is not there, is lost meanwhile, or has no watchdog and needs one.
    """
    try:
        driver.open()
        check_watchdog(driver.description.model, driver.description, is_needed=needs_watchdog)
        yield driver
    except DeviceLostError as error:
        raise DeviceError(str(error)) from None
    finally:
        driver.close()


def probe(driver: Driver, print_line: Callable[[str], None]) -> None:
    """Print what a robot is, and what it measures within a second, standing still."""
    with opened(driver, needs_watchdog=False):  # it stands still
        for line in _describe(driver.description):
            print_line(line)
        readings: list[Reading] = []
        end_s = time.monotonic() + _PROBE_S
        while time.monotonic() < end_s:
            reading = driver.read(PERIOD_S)
            readings += [reading] if reading is not None else []
        if not readings:
            raise DeviceLostError(driver.trouble or "no reading")
        last = readings[-1]
        print_line(f"readings    {len(readings) / _PROBE_S:.0f} a second")
        proximity = last.row[contract.PROXIMITY : contract.PROXIMITY + contract.PROXIMITY_SENSORS]
        print_line(f"proximity   {' '.join(f'{m:.3f}' for m in proximity)} m, right to left")
        print_line(f"battery     {last.row[contract.BATTERY]:.0%} ({last.battery_v:.2f} V)")
        print_line(f"stopped     {'yes: crcolony estop --clear' if last.is_stopped else 'no'}")


def drive(
    driver: Driver,
    left_m_s: float,
    right_m_s: float,
    seconds: float,
    print_line: Callable[[str], None],
    *,
    needs_watchdog: bool = True,
) -> None:
    """Turn the wheels for some seconds, and print how fast they turn."""
    with opened(driver, needs_watchdog=needs_watchdog):
        body = DriverBody(driver, PERIOD_S)
        for k, row in enumerate(_driven(body, left_m_s, right_m_s, seconds)):
            if k % 5 == 0:
                left, right = row[_WHEELS]
                print_line(
                    f"wheels {left:+.3f} {right:+.3f} m/s, gyro {row[contract.GYRO]:+.2f} rad/s"
                )


def calibrate(
    driver: Driver,
    folder: Path,
    speed_m_s: float,
    print_line: Callable[[str], None],
    *,
    needs_watchdog: bool = True,
) -> Path:
    """Measure what differs in this very robot, standing, driving ahead and turning; write it, and return where."""
    with opened(driver, needs_watchdog=needs_watchdog):
        robot = driver.description
        before = Calibration.load(folder, robot.uid)
        body = DriverBody(driver, PERIOD_S)
        print_line("stands still")
        bias = float(np.mean([row[contract.GYRO] for row in _driven(body, 0.0, 0.0, _STILL_S)]))
        print_line(f"drives ahead for {_AHEAD_S:g} s")
        ahead = list(_driven(body, speed_m_s, speed_m_s, _AHEAD_S))[_STEADY:]
        wheels = [statistics.median(row[contract.WHEELS + k] for row in ahead) for k in (0, 1)]
        print_line(f"turns for {_TURN_S:g} s")
        turning = list(_driven(body, -speed_m_s, speed_m_s, _TURN_S))[_STEADY:]
        turn = statistics.median(row[contract.GYRO] for row in turning) - bias
        across = statistics.median(float(row[_WHEELS] @ (-1.0, 1.0)) for row in turning)
        changes = {
            "wheel_left": _scale(wheels[0], speed_m_s),
            "wheel_right": _scale(wheels[1], speed_m_s),
            "gyro_bias_rad_s": bias,
            "track_m": across / turn if turn > _LEAST_TURN_RAD_S else before.track_m,
        }
    after = msgspec.structs.replace(before, **{k: round(v, 5) for k, v in changes.items()})
    for name, value in changes.items():
        print_line(f"{name:<16} {value:.4f}")
    if turn <= _LEAST_TURN_RAD_S:
        print_line("no gyro: measure the distance between the wheels, and write it into track_m")
    return after.save(folder, robot.uid)


def motion(left_m_s: float, right_m_s: float) -> FloatArray:
    """Return an action (ACTION_WIDTH,) that turns the wheels for a few control periods."""
    action = np.zeros(contract.ACTION_WIDTH)
    action[[contract.WHEEL_LEFT, contract.WHEEL_RIGHT, contract.TTL]] = left_m_s, right_m_s, _TTL_S
    return action


def _driven(
    body: DriverBody, left_m_s: float, right_m_s: float, seconds: float
) -> Iterator[FloatArray]:
    """Yield an observation every control period while the wheels turn so."""
    for _ in range(round(seconds / PERIOD_S)):
        body.act(motion(left_m_s, right_m_s))
        yield body.read()


def _scale(measured_m_s: float, commanded_m_s: float) -> float:
    return min(max(measured_m_s / commanded_m_s, 0.5), 2.0)


def _describe(robot: RobotDescription) -> Iterator[str]:
    yield f"model       {robot.model}"
    yield f"uid         {robot.uid}"
    yield f"wheels      {robot.track_m:.3f} m apart, at most {robot.max_speed_m_s:.3f} m/s"
    yield f"proximity   {len(robot.proximity_bearings_rad)} sensors, {robot.proximity_range_m:.2f} m"
    yield f"infrared    {robot.ir}"
    if robot.watchdog == "none":
        yield "watchdog    NONE: its wheels turn on if this machine dies"
    else:
        yield f"watchdog    {robot.watchdog}, {robot.watchdog_s:g} s"
