"""A BBC micro:bit with two motors on a driver like the TB6612FNG, and two detectors of obstacles.

Left motor: speed (PWM) on pin 0, ahead while pin 8 is high, back while pin 12 is. Right motor: pins 1, 13 and 14. While
both pins are low the motor is off; they need pull-downs, for after a reset nobody drives them. Detectors, left and
right, low when they see an obstacle: pins 15 and 16.
"""

from machine import unique_id  # type: ignore[import-not-found]
from microbit import (  # type: ignore[import-not-found]
    pin0,
    pin1,
    pin8,
    pin12,
    pin13,
    pin14,
    pin15,
    pin16,
    sleep,
    uart,
)
from micropython import kbd_intr  # type: ignore[import-not-found]
from utime import ticks_diff, ticks_ms  # type: ignore[import-not-found]


class Microbit:
    """See `crcolony_bridge.micropython.board.Board`."""

    uid = unique_id()
    description = (
        b'{"model":"micro:bit with two motors","track_m":0.09,"radius_m":0.07,'
        b'"max_speed_m_s":0.2,"proximity_bearings_rad":[0.5,-0.5],"proximity_range_m":0.1,'
        b'"battery_empty_v":0,"battery_full_v":0,"watchdog_s":0.5}'
    )
    capabilities = 0
    proximity_sensors = 2
    battery_low_mv = battery_critical_mv = 0

    def __init__(self) -> None:
        self.now = 0
        self.ticked = ticks_ms()
        for pin in (pin15, pin16):
            pin.set_pull(pin.PULL_UP)
        kbd_intr(-1)  # a frame may hold any byte, that of Ctrl-C too

    def received(self) -> bytes:
        data = uart.read()
        if data is None:
            sleep(1)
        return data or b""

    def send(self, data: bytes) -> None:
        uart.write(data)

    def ms(self) -> int:
        ticked = ticks_ms()  # it wraps after twelve days
        self.now += ticks_diff(ticked, self.ticked)
        self.ticked = ticked
        return self.now

    def set_wheels(self, left_mm_s: int, right_mm_s: int) -> None:
        for speed, ahead, back, mm_s in (
            (pin0, pin8, pin12, left_mm_s),
            (pin1, pin13, pin14, right_mm_s),
        ):
            ahead.write_digital(mm_s > 0)
            back.write_digital(mm_s < 0)
            speed.write_analog(min(abs(mm_s) * 1023 // 200, 1023))

    def set_outputs(self, red: int, green: int, blue: int, speaker: int, switches: int) -> None:
        pass

    def battery_mv(self) -> int:
        return 0

    def proximity_mm(self, sensor: int) -> int:
        return 0xFFFF if (pin15, pin16)[sensor].read_digital() else 50

    def release(self) -> None:
        kbd_intr(3)
