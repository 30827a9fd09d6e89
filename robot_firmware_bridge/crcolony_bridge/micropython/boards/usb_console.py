"""The USB console of a board with MicroPython for RP2040 or RP2350, as the link to the host."""

import sys
from select import POLLIN, poll

from micropython import kbd_intr  # type: ignore[import-not-found]
from utime import sleep_ms, ticks_diff, ticks_ms  # type: ignore[import-not-found]

MAX_BYTES = 64
"""That are read at once: as many as come in a packet of USB."""


class UsbConsole:
    """See `crcolony_bridge.micropython.board.Board` for what these do."""

    def __init__(self) -> None:
        self.now = 0
        self.ticked = ticks_ms()
        self.input = poll()
        self.input.register(sys.stdin, POLLIN)
        kbd_intr(-1)  # a frame may hold any byte, that of Ctrl-C too

    def received(self) -> bytes:
        data = b""
        while len(data) < MAX_BYTES and self.input.poll(0):
            byte = sys.stdin.buffer.read(1)
            if not byte:
                break
            data += byte
        if not data:
            sleep_ms(1)
        return data

    def send(self, data: bytes) -> None:
        sys.stdout.buffer.write(data)

    def ms(self) -> int:
        ticked = ticks_ms()  # it wraps after twelve days
        self.now += ticks_diff(ticked, self.ticked)
        self.ticked = ticked
        return self.now

    def release(self) -> None:
        kbd_intr(3)
