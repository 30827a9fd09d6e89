"""A SparkFun XRP: the one of today, and the beta with an RP2040, whose motors are driven otherwise.

Its pins have names in the MicroPython for it. What is assumed: 0.6 m/s when its motors have all of the battery. The
ultrasonic rangefinder looks ahead; it is not waited for longer than an echo from half a metre takes. The battery is not
measured: its pin says only whether the motors have power.
"""

from machine import PWM, Pin, time_pulse_us, unique_id  # type: ignore[import-not-found]
from utime import sleep_us  # type: ignore[import-not-found]

from crcolony_bridge.micropython.boards.usb_console import UsbConsole

FULL_SPEED_MM_S = 600
FULL_DUTY = 65534
"""With one more the beta's motors brake."""
ECHO_US = 2950
"""From half a metre, there and back"""
MM_PER_1000_US = 171
"""Half of what sound goes"""


class Xrp:
    """See `crcolony_bridge.micropython.board.Board`."""

    uid = unique_id()
    description = (
        b'{"model":"XRP","track_m":0.155,"radius_m":0.1,'
        b'"max_speed_m_s":0.5,"proximity_bearings_rad":[0],"proximity_range_m":0.5,'
        b'"battery_empty_v":0,"battery_full_v":0,"watchdog_s":0.5}'
    )
    capabilities = 0
    proximity_sensors = 1
    battery_low_mv = battery_critical_mv = 0

    def __init__(self) -> None:
        self.console = UsbConsole()
        self.received, self.send = self.console.received, self.console.send
        self.ms, self.release = self.console.ms, self.console.release
        self.trigger = Pin("RANGE_TRIGGER", Pin.OUT, value=0)
        self.echo = Pin("RANGE_ECHO", Pin.IN)
        self.is_beta = not hasattr(Pin.board, "BOARD_NEOPIXEL")
        self.motors = []
        for side in ("MOTOR_L", "MOTOR_R"):
            first, second = [Pin(side + end, Pin.OUT, value=0) for end in ("_IN_1", "_IN_2")]
            back = PWM(second, freq=50, duty_u16=0)
            self.motors.append((first if self.is_beta else PWM(first, freq=50, duty_u16=0), back))

    def set_wheels(self, left_mm_s: int, right_mm_s: int) -> None:
        left, right = self.motors
        # The left motor is mounted the other way round.
        for (first, second), mm_s in ((left, -left_mm_s), (right, right_mm_s)):
            duty = min(abs(mm_s) * FULL_DUTY // FULL_SPEED_MM_S, FULL_DUTY)
            if self.is_beta:
                first.value(mm_s < 0)
                second.duty_u16(duty)
            else:
                first.duty_u16(duty if mm_s < 0 else 0)
                second.duty_u16(0 if mm_s < 0 else duty)

    def set_outputs(self, red: int, green: int, blue: int, speaker: int, switches: int) -> None:
        pass

    def battery_mv(self) -> int:
        return 0

    def proximity_mm(self, sensor: int) -> int:
        self.trigger.value(1)
        sleep_us(10)
        self.trigger.value(0)
        echo_us = time_pulse_us(self.echo, 1, ECHO_US)  # negative if there is none
        return echo_us * MM_PER_1000_US // 1000 if echo_us > 0 else 0xFFFF
