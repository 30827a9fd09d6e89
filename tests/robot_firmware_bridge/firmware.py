"""The firmware, built from its sources for this machine and for an emulated controller."""

import ctypes
import functools
import shutil
import subprocess
import tempfile
from collections.abc import Iterable
from pathlib import Path

import pytest
from crcolony_bridge.reference_firmware.frames import Frame, FrameReader, encode_frame
from crcolony_bridge.reference_firmware.messages import MessageType, Telemetry

from tests.support.paths import ROOT

FIRMWARE = ROOT / "robot_firmware_bridge" / "firmware"

WORDS_ALONE = "-DIR_MAX_MESSAGE=2u -DIR_PAUSE_MS=92u"
"""Infrared that is as slow as a Thymio's: a word of two bytes, every 92 to 107 ms"""

needs_compiler = pytest.mark.skipif(
    shutil.which("cc") is None or shutil.which("make") is None, reason="there is no C compiler"
)
needs_avr = pytest.mark.skipif(
    shutil.which("avr-gcc") is None or not Path("/usr/include/simavr").exists(),
    reason="apt-get install gcc-avr avr-libc simavr libsimavr-dev",
)
needs_cortex_m3 = pytest.mark.skipif(
    any(shutil.which(tool) is None for tool in ("arm-none-eabi-gcc", "qemu-system-arm")),
    reason="apt-get install --no-install-recommends gcc-arm-none-eabi qemu-system-arm",
)


@functools.cache
def build(target: str, uid: int = 1, defines: str = "") -> Path:
    """Build a target of the firmware's Makefile, with warnings as errors; return the folder of what is built.

    `uid` is the first byte of the uid of the robots with this firmware, `defines` what differs from its defaults.
    """
    folder = Path(tempfile.mkdtemp(prefix="firmware-"))
    settings = [f"BUILD={folder}", f"UID={uid},2,3,4,5,6,7,8", f"DEFINES={defines}"]
    done = subprocess.run(
        ["make", "-C", str(FIRMWARE), target, *settings],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return folder


class HostRobot:
    """The firmware's core without hardware, in virtual time (`firmware/hal/host`)."""

    def __init__(self) -> None:
        self._library = ctypes.CDLL(str(build("host") / "librobot.so"))
        self._library.host_take_sent.restype = ctypes.c_size_t
        self._buffer = ctypes.create_string_buffer(4096)
        self._reader = FrameReader()
        self.start()

    def start(self, now_ms: int = 0, cause: int = 1, keeps_latch: bool = False) -> None:
        """Reset the robot."""
        self._library.host_start(ctypes.c_uint32(now_ms), cause, keeps_latch)
        self._reader = FrameReader()

    def receive(self, data: bytes) -> None:
        """Let bytes of the host arrive."""
        self._library.host_receive(data, ctypes.c_size_t(len(data)))

    def receive_ir(self, data: bytes) -> None:
        """Let bytes of another robot's infrared arrive."""
        self._library.host_receive_ir(data, ctypes.c_size_t(len(data)))

    def run(self, ms: int) -> None:
        """Let time pass."""
        self._library.host_run(ctypes.c_uint32(ms))

    def sent(self) -> list[Frame]:
        """Return the frames that were sent to the host since the last call."""
        return list(self._reader.feed(self._take(0)))

    def sent_ir(self) -> bytes:
        """Return the bytes that were sent by infrared since the last call."""
        return self._take(1)

    def ask(self, frames: Frame | Iterable[Frame]) -> list[Frame]:
        """Send frames, and return what is answered at once."""
        self.sent()
        for frame in [frames] if isinstance(frames, Frame) else frames:
            self.receive(encode_frame(frame))
        return self.sent()

    def telemetry(self) -> Telemetry:
        """Return the next telemetry."""
        self.sent()
        for _ in range(1000):
            self.run(1)
            for frame in self.sent():
                if frame.type == MessageType.TELEMETRY:
                    return Telemetry.parse(frame)
        raise AssertionError("no telemetry")

    @property
    def wheels(self) -> tuple[int, int]:
        """The speeds that the motors are given (mm/s)."""
        return self._library.host_left_mm_s(), self._library.host_right_mm_s()

    def set_battery(self, mv: int) -> None:
        """Set the battery's voltage."""
        self._library.host_set_battery(mv)

    def set_room(self, link: int, size: int) -> None:
        """Set the room in a transmit queue."""
        self._library.host_set_room(link, ctypes.c_size_t(size))

    def is_fed(self) -> bool:
        """Return whether the watchdog was fed since the last call."""
        return bool(self._library.host_is_fed())

    def _take(self, link: int) -> bytes:
        length = self._library.host_take_sent(link, self._buffer)
        return self._buffer.raw[:length]
