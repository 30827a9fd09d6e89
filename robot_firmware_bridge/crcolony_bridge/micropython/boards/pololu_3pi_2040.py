"""A Pololu 3pi+ 2040, standard edition: 1.5 m/s when its motors have all of the battery.

Pins and the battery's divider are those of Pololu's own library for MicroPython. It has no sensors of distance: its
reflectance sensors look at the floor. The battery is four NiMH cells; they are low at 1.15 V each, critical at 1.1 V.
"""

from machine import ADC, PWM, Pin, unique_id  # type: ignore[import-not-found]

from crcolony_bridge.micropython.boards.usb_console import UsbConsole

FULL_SPEED_MM_S = 1500
FULL_DUTY = 65535
DIVIDER_MV = 36300
"""Of the battery, when the converter reads its highest value: 3.3 V, an eleventh of it"""


class Pololu3pi:
    """See `crcolony_bridge.micropython.board.Board`."""

    uid = unique_id()
    description = (
        b'{"model":"Pololu 3pi+ 2040","track_m":0.086,"radius_m":0.049,'
        b'"max_speed_m_s":0.5,"proximity_bearings_rad":[],"proximity_range_m":0.3,'
        b'"battery_empty_v":4.4,"battery_full_v":5.4,"watchdog_s":0.5}'
    )
    capabilities = 0
    proximity_sensors = 0
    battery_low_mv, battery_critical_mv = 4600, 4400

    def __init__(self) -> None:
        self.console = UsbConsole()
        self.received, self.send = self.console.received, self.console.send
        self.ms, self.release = self.console.ms, self.console.release
        self.battery = ADC(Pin(26))
        # Both motors have one slice of the PWM: frequency and zero, before they are told anything.
        self.motors = [
            (Pin(direction, Pin.OUT, value=0), PWM(Pin(speed), freq=20833, duty_u16=0))
            for direction, speed in ((11, 15), (10, 14))
        ]

    def set_wheels(self, left_mm_s: int, right_mm_s: int) -> None:
        left, right = self.motors
        for (direction, speed), mm_s in ((left, left_mm_s), (right, right_mm_s)):
            direction.value(mm_s < 0)
            speed.duty_u16(min(abs(mm_s) * FULL_DUTY // FULL_SPEED_MM_S, FULL_DUTY))

    def set_outputs(self, red: int, green: int, blue: int, speaker: int, switches: int) -> None:
        pass

    def battery_mv(self) -> int:
        return int(self.battery.read_u16() * DIVIDER_MV // FULL_DUTY)

    def proximity_mm(self, sensor: int) -> int:
        return 0xFFFF
