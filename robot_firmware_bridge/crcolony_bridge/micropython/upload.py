"""Puts the robot script onto a controller that runs MicroPython, by its raw REPL, and starts it there.

The REPL has no flow control, and little memory: the source goes one statement of a module at a time (`source.py`), in
slices that its receive buffer holds. What is uploaded is in the controller's memory alone, and gone after a reset.
"""

import time

from crcolony_bridge.errors import DeviceError, DeviceLostError
from crcolony_bridge.link import Link
from crcolony_bridge.micropython.source import statements
from crcolony_bridge.reference_firmware import messages
from crcolony_bridge.reference_firmware.frames import FrameReader, encode_frame
from crcolony_bridge.reference_firmware.messages import MessageType

_USB_CONSOLE = "boards/usb_console.py"
BOARDS = {
    "microbit": (("boards/microbit.py",), "Microbit"),
    "pololu_3pi_2040": ((_USB_CONSOLE, "boards/pololu_3pi_2040.py"), "Pololu3pi"),
    "xrp": ((_USB_CONSOLE, "boards/xrp.py"), "Xrp"),
}
"""The modules of each board, and its class."""
_INTERRUPT, _RAW, _EXECUTE = b"\r\x03\x03", b"\x01", b"\x04"
_PROMPT = b"raw REPL; CTRL-B to exit\r\n>"
_SLICE_BYTES, _PAUSE_S = 32, 0.01
_REPLY_WITHIN_S = 1.5
_TRIES, _PONG_WITHIN_S = 2, 0.3


def upload(link: Link, board: str, address: str) -> None:
    """Upload the script for a board of `BOARDS`, unless it is running already: its latch is kept then.

    Raises DeviceError where a person has to do something, and DeviceLostError if the device goes meanwhile.
    """
    if is_running(link):
        return
    _enter_raw_mode(link, address)
    _execute(link, b"import gc, micropython\nmicropython.opt_level(3)", address)  # no line numbers
    modules, name = BOARDS[board]
    for statement in statements([*modules, "robot_script.py"], {"run", name}):
        _execute(link, statement, address)
        _execute(link, b"gc.collect()", address)  # or memory is in too many pieces
    _send(link, f"run({name}())".encode())
    _wait_for_boot(link, address)


def is_running(link: Link) -> bool:
    """Return whether a robot script answers."""
    reader = FrameReader()
    for seq in range(_TRIES):
        link.write(b"\0" + encode_frame(messages.ping(0, seq)))
        end_s = time.monotonic() + _PONG_WITHIN_S
        while (left_s := end_s - time.monotonic()) > 0.0:
            if any(frame.type == MessageType.PONG for frame in reader.feed(link.read(left_s))):
                return True
    return False


def _enter_raw_mode(link: Link, address: str) -> None:
    """End what is running, and begin with empty memory."""
    for _ in range(_TRIES):
        link.write(_INTERRUPT)
        time.sleep(0.05)  # what is interrupted may print, and answers nothing
        link.write(_RAW)
        if _PROMPT in _read_until(link, _PROMPT):
            link.write(_EXECUTE)  # of nothing: a soft reset
            if _PROMPT in _read_until(link, _PROMPT):
                return
    raise DeviceError(
        f"{address}: no MicroPython answers; check the baud rate, and whether MicroPython is on it"
    )


def _send(link: Link, source: bytes) -> None:
    for start in range(0, len(source), _SLICE_BYTES):
        link.write(source[start : start + _SLICE_BYTES])
        time.sleep(_PAUSE_S)
    link.write(_EXECUTE)


def _execute(link: Link, source: bytes, address: str) -> None:
    """Execute a statement, and wait until it is done."""
    _send(link, source)
    answer = _read_until(link, b"\x04>")
    accepted, _, rest = answer.partition(b"OK")
    error = rest.partition(b"\x04")[2].removesuffix(b"\x04>")
    if accepted or not answer.endswith(b"\x04>"):
        raise DeviceLostError(f"{address}: the upload was garbled")
    if error:
        raise DeviceError(f"{address}: MicroPython refuses the script: {_last_line(error)}")


def _wait_for_boot(link: Link, address: str) -> None:
    answer = _read_until(link, b"\0")  # which ends a frame, and is nowhere in what the REPL says
    frames = FrameReader().feed(answer.partition(b"OK")[2])
    if not any(frame.type == MessageType.BOOT for frame in frames):
        error = answer.rstrip(b"\x04>") or b"no answer"
        raise DeviceError(f"{address}: the script does not start: {_last_line(error)}")


def _last_line(error: bytes) -> str:
    return error.decode(errors="replace").strip().splitlines()[-1]


def _read_until(link: Link, end: bytes) -> bytes:
    """Return what arrives up to `end`, or within the time."""
    data = b""
    end_s = time.monotonic() + _REPLY_WITHIN_S
    while end not in data and (left_s := end_s - time.monotonic()) > 0.0:
        data += link.read(left_s)
    return data
