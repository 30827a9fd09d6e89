"""The byte stream to a robot: a serial device, or TCP for emulators, simulators and serial servers."""

import errno
import grp
import os
import select
import socket
import stat
import time
from contextlib import suppress
from pathlib import Path
from typing import Protocol

import serial

from crcolony_bridge.errors import DeviceError, DeviceLostError

_CONNECT_TIMEOUT_S = 2.0
_READ_BYTES = 4096
_GATHER_S = 0.001
"""A serial line brings a frame byte by byte: those that follow the first one are read together, not each for itself."""


class Link(Protocol):
    """A byte stream; one thread reads while another one may write."""

    def read(self, timeout_s: float) -> bytes:
        """Wait for bytes for so long and return them, none after a time-out; raises DeviceLostError."""
        ...

    def write(self, data: bytes) -> None:
        """Send bytes; raises DeviceLostError."""
        ...

    def close(self) -> None:
        """Close the stream."""
        ...


def open_link(address: str, baud: int) -> Link:
    """Open `tcp:HOST:PORT` or the path of a serial device.

    Raises DeviceError where a person has to do something, and DeviceLostError for what may come by itself: a device
    that is not plugged in, or a server that is not there.
    """
    kind, _, rest = address.partition(":")
    if kind != "tcp":
        return SerialLink(address, baud)
    host, _, port = rest.rpartition(":")
    if not host or not port.isdigit() or not 0 < int(port) < 65536:
        raise DeviceError(f"{address}: expected tcp:HOST:PORT, as in tcp:127.0.0.1:33333")
    return TcpLink(host, int(port), address)


def renumbered(path: str) -> list[str]:
    """Return the devices as which one that was plugged in again may be there: ttyACM1 for ttyACM0."""
    stem = path.rstrip("0123456789")
    if stem == path or Path(path).exists():
        return []
    beside = Path(stem).parent.glob(f"{Path(stem).name}*")
    return sorted(
        str(found) for found in beside if str(found).removeprefix(stem).isdigit() and found.exists()
    )


class SerialLink:
    """A serial device, which no other process of this machine may open meanwhile."""

    def __init__(self, path: str, baud: int) -> None:
        self._path = path
        _check_device(path)
        try:
            # Opening must not toggle the lines by which many boards are reset.
            self._port = serial.Serial(
                baudrate=baud, timeout=0.0, write_timeout=0.5, exclusive=True
            )
            self._port.dtr = True
            self._port.port = path
            self._port.open()
        except (serial.SerialException, OSError, ValueError) as error:
            raise _explain(path, error) from None

    def read(self, timeout_s: float) -> bytes:
        """Wait for bytes; see `Link`."""
        try:
            # Not by pyserial's own `read`, which configures the device anew for every other time-out.
            if not select.select([self._port], [], [], timeout_s)[0]:
                return b""
            time.sleep(_GATHER_S)
            data = os.read(self._port.fileno(), _READ_BYTES)
        except (OSError, ValueError) as error:  # ValueError, and -1 for a file: closed meanwhile
            raise DeviceLostError(f"{self._path}: unplugged ({error})") from None
        if not data:
            raise DeviceLostError(f"{self._path}: unplugged")
        return data

    def write(self, data: bytes) -> None:
        """Send bytes; see `Link`."""
        try:
            self._port.write(data)
        except (serial.SerialException, OSError, TypeError) as error:
            raise DeviceLostError(f"{self._path}: unplugged ({error})") from None

    def close(self) -> None:
        """Close the device."""
        with suppress(serial.SerialException, OSError):
            self._port.close()


class TcpLink:
    """A TCP connection."""

    def __init__(self, host: str, port: int, address: str) -> None:
        self._address = address
        try:
            self._socket = socket.create_connection((host, port), _CONNECT_TIMEOUT_S)
        except OSError as error:
            raise DeviceLostError(f"{address}: {error.strerror or error}") from None
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def read(self, timeout_s: float) -> bytes:
        """Wait for bytes; see `Link`."""
        try:
            self._socket.settimeout(timeout_s)
            data = self._socket.recv(_READ_BYTES)
        except (TimeoutError, BlockingIOError):  # the latter if nothing is to be waited for
            return b""
        except OSError as error:
            raise DeviceLostError(f"{self._address}: {error.strerror or error}") from None
        if not data:
            raise DeviceLostError(f"{self._address}: closed by the other side")
        return data

    def write(self, data: bytes) -> None:
        """Send bytes; see `Link`."""
        try:
            self._socket.sendall(data)
        except OSError as error:
            raise DeviceLostError(f"{self._address}: {error.strerror or error}") from None

    def close(self) -> None:
        """Close the connection."""
        with suppress(OSError):
            self._socket.close()


def _check_device(path: str) -> None:
    """Raise DeviceError for what is there and cannot be a serial device, or may not be used by this user."""
    try:
        found = Path(path).stat()
    except OSError as error:
        if error.errno == errno.ENOENT:
            raise DeviceLostError(f"{path}: there is no such device") from None
        raise DeviceError(f"{path}: {error.strerror}") from None
    if not stat.S_ISCHR(found.st_mode):
        raise DeviceError(f"{path}: not a serial device")
    if not os.access(path, os.R_OK | os.W_OK):
        raise DeviceError(f"{path}: permission denied: {_remedy(found.st_gid)}")


def _remedy(group: int) -> str:
    try:
        name = grp.getgrgid(group).gr_name
    except KeyError:
        name = str(group)
    return f"add yourself to the group {name} (sudo usermod -aG {name} $USER) and log in again"


def _explain(path: str, error: Exception) -> DeviceError | DeviceLostError:
    number = getattr(error, "errno", None)
    if number in (errno.EBUSY, errno.EAGAIN) or "exclusively lock" in str(error):
        return DeviceError(f"{path}: another program uses it")
    if number in (errno.EACCES, errno.EPERM):
        return DeviceError(f"{path}: permission denied: {_remedy(Path(path).stat().st_gid)}")
    if number in (errno.ENOENT, errno.ENXIO, errno.EIO):
        return DeviceLostError(f"{path}: unplugged")
    return DeviceError(f"{path}: {error}")
