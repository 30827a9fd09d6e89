"""A link carries bytes, and says in one line what is wrong with a device."""

import os
import pty
import socket
import tty
from collections.abc import Iterator

import pytest
from crcolony_bridge.errors import DeviceError, DeviceLostError
from crcolony_bridge.link import Link, open_link


@pytest.fixture(params=["serial", "tcp"])
def ends(request: pytest.FixtureRequest) -> Iterator[tuple[Link, socket.socket | int]]:
    """A link and its other end."""
    if request.param == "serial":
        other, device = pty.openpty()
        tty.setraw(device)
        link = open_link(os.ttyname(device), 115_200)
        yield link, other
        os.close(device)
    else:
        with socket.create_server(("127.0.0.1", 0)) as server:
            link = open_link(f"tcp:127.0.0.1:{server.getsockname()[1]}", 0)
            end, _ = server.accept()
            yield link, end
            end.close()
    link.close()


def say(end: socket.socket | int, data: bytes) -> None:
    """Send from the other end."""
    if isinstance(end, int):
        os.write(end, data)
    else:
        end.sendall(data)


def test_bytes_go_both_ways(ends: tuple[Link, socket.socket | int]) -> None:
    """And a read that times out returns none."""
    link, other = ends
    assert link.read(0.01) == b""
    assert link.read(0.0) == b""
    say(other, b"hello")
    data = b""
    while len(data) < 5:
        data += link.read(1.0)
    assert data == b"hello"
    link.write(b"there")
    assert (os.read(other, 10) if isinstance(other, int) else other.recv(10)) == b"there"


def test_a_connection_that_the_other_side_closes_is_a_loss() -> None:
    """A serial cable that is pulled is in reference_firmware/test_driver.py."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        link = open_link(f"tcp:127.0.0.1:{server.getsockname()[1]}", 0)
        server.accept()[0].close()
        with pytest.raises(DeviceLostError, match="closed by the other side"):
            link.read(1.0)
        link.close()


@pytest.mark.parametrize(
    ("address", "error", "line"),
    [
        ("tcp:127.0.0.1", DeviceError, "expected tcp:HOST:PORT"),
        ("tcp:127.0.0.1:0", DeviceError, "expected tcp:HOST:PORT"),
        ("tcp:127.0.0.1:70000", DeviceError, "expected tcp:HOST:PORT"),
        ("tcp:127.0.0.1:1", DeviceLostError, "refused"),
        ("/dev/there-is-none", DeviceLostError, "there is no such device"),
        ("/etc/passwd", DeviceError, "not a serial device"),
        ("/etc", DeviceError, "not a serial device"),
        ("", DeviceError, "not a serial device"),
    ],
)
def test_what_is_no_device_is_said(address: str, error: type[Exception], line: str) -> None:
    """A person has to do something, or it may come by itself."""
    with pytest.raises(error, match=line):
        open_link(address, 115_200)


def test_a_device_that_we_may_not_use_names_the_group() -> None:
    """And the command that helps."""
    terminal, device = pty.openpty()
    os.fchmod(device, 0o600)
    path, (reading, writing) = os.ttyname(device), os.pipe()
    child = os.fork()
    if child == 0:  # root may use every device: nobody tries
        if os.geteuid() == 0:
            os.setuid(65534)
        else:
            path = "/dev/mem"
        try:
            open_link(path, 115_200)
        except DeviceError as error:
            os.write(writing, str(error).encode())
        os._exit(0)
    os.waitpid(child, 0)
    os.close(writing)
    with open(reading, encoding="utf-8") as pipe:
        line = pipe.read()
    os.close(terminal)
    os.close(device)
    assert "permission denied: add yourself to the group" in line
    assert "usermod" in line
