"""What this machine can reach: whether anybody answers at an endpoint, and the own address on the way to it.

Zenoh tries silently, so the reason why an endpoint cannot be reached is found by a plain connection of our own.
"""

import contextlib
import errno
import socket
import struct
import sys
from collections.abc import Callable, Iterator
from typing import Any, TypeVar

from crcolony.transport.endpoint import DATAGRAMS, UNIX_SOCKET, Endpoint
from crcolony.transport.interface import NetworkError, NetworkUnavailableError

_T = TypeVar("_T")
_LOOPBACK = "127.0.0.1"
_NAME_ERRORS = {
    socket.EAI_AGAIN: "its name cannot be looked up now",
    socket.EAI_NONAME: "its name is unknown",
}
_REASONS = {
    errno.ECONNREFUSED: "connection refused",
    errno.ETIMEDOUT: "timed out",
    errno.ENETUNREACH: "network unreachable",
    errno.EHOSTUNREACH: "no route to host",
    errno.ENODEV: "no such interface",
    errno.ENOENT: "no such socket",
}


def reason_unreachable(endpoint: Endpoint, timeout_s: float) -> str:
    """Return why nobody can be reached at an endpoint; empty if somebody answers, or if UDP cannot tell."""
    try:
        if endpoint.protocol == UNIX_SOCKET:
            _connect_unix(endpoint.address, timeout_s)
        elif endpoint.protocol in DATAGRAMS:
            own_address_towards(endpoint)
        else:
            _connect_tcp(endpoint, timeout_s)
    except OSError as error:
        return format_reason(error)
    return ""


def own_address_towards(endpoint: Endpoint) -> str:
    """Return this machine's address from which packets to an endpoint go; raises OSError without a way to it."""
    if endpoint.protocol == UNIX_SOCKET:
        return _LOOPBACK

    def use(probe: socket.socket, address: Any) -> str:
        probe.connect(address)
        return _own_host(probe)

    return _at_any_address(endpoint, socket.SOCK_DGRAM, use)


def format_reason(error: OSError) -> str:
    """Return why a connection or a look-up failed, in few words."""
    if isinstance(error, socket.gaierror):
        return _NAME_ERRORS.get(error.errno or 0, error.strerror or str(error))
    if isinstance(error, TimeoutError):
        return "timed out"
    return _REASONS.get(error.errno or 0, error.strerror or str(error))


def address_of_interface(name: str) -> str:
    """Return the IPv4 address of a network interface (Linux only).

    Raises NetworkUnavailableError while it has none or is down, and NetworkError if it has no multicast.
    """
    import fcntl

    siocgifflags, siocgifaddr = 0x8913, 0x8915
    is_up, has_multicast = 0x1, 0x1000
    request = struct.pack("256s", name[:15].encode())
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            flags = struct.unpack("H", fcntl.ioctl(probe.fileno(), siocgifflags, request)[16:18])[0]
            answer = fcntl.ioctl(probe.fileno(), siocgifaddr, request)
        except OSError as error:
            raise NetworkUnavailableError(
                f"interface {name}: {error.strerror}; it needs an IPv4 address"
            ) from None
    if not flags & has_multicast:
        raise NetworkError(
            f"interface {name}: it has no multicast; use --connect and --listen instead"
        )
    if not flags & is_up:
        raise NetworkUnavailableError(f"interface {name}: it is down")
    return socket.inet_ntoa(answer[20:24])


def _connect_unix(path: str, timeout_s: float) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        probe.settimeout(timeout_s)
        probe.connect(path)


def _connect_tcp(endpoint: Endpoint, timeout_s: float) -> None:
    """Connect to any address of an endpoint, and close at once; raises OSError of the last address."""

    def use(probe: socket.socket, address: Any) -> None:
        probe.settimeout(timeout_s)
        probe.connect(address)

    _at_any_address(endpoint, socket.SOCK_STREAM, use)


def _at_any_address(
    endpoint: Endpoint, kind: socket.SocketKind, use: Callable[[socket.socket, Any], _T]
) -> _T:
    """Use a socket with every address of an endpoint in turn until that works; raises OSError of the last one."""
    problem: OSError | None = None
    for family, address in _addresses(endpoint):
        with socket.socket(family, kind) as probe:
            try:
                _bind_to_interface(probe, endpoint.interface)
                return use(probe, address)
            except OSError as error:
                problem = error
    raise problem or OSError(errno.EADDRNOTAVAIL, "it has no address")


def _addresses(endpoint: Endpoint) -> Iterator[tuple[int, Any]]:
    """Yield family and socket address of everything that the endpoint's name means; raises OSError."""
    found = socket.getaddrinfo(endpoint.host, endpoint.port, type=socket.SOCK_STREAM)
    yield from ((family, address) for family, _, _, _, address in found)


def _own_host(bound: socket.socket) -> str:
    """Return the address of a socket; a link-local one with the number of its interface, as Zenoh reads it."""
    host, _, *scope = bound.getsockname()
    name, percent, _ = str(host).partition("%")
    return f"{name}%{scope[1]}" if percent else name


def _bind_to_interface(probe: socket.socket, interface: str) -> None:
    if interface and sys.platform.startswith("linux"):
        with contextlib.suppress(PermissionError):  # of older kernels: only root may
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_BINDTODEVICE, interface.encode())
