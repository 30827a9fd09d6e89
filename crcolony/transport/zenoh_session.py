"""How a process connects to the network: as a peer of a mesh, by seeds or multicast, or as a client of routers.

Up to about 32 robots a full mesh is the simplest; beyond, robots are clients of one or more interchangeable routers,
which hold no state. Only the configuration differs. Zenoh's defaults that do harm here are replaced: shared memory is
off, there is one mechanism of discovery, leases are short, and sizes are limited.
"""

import contextlib
import errno
import json
import os
import socket
import struct
import sys
from typing import Annotated, Any, Literal

import msgspec
import zenoh
from msgspec import Meta
from zenoh.handlers import Callback

from crcolony.protocol.codec import MAX_SCENE_BYTES
from crcolony.transport.interface import NetworkError

PORT = 7447
HERE = f"tcp/127.0.0.1:{PORT}"
"""Default endpoint, where the processes of one machine find each other."""

_TWO_THREADS = (
    "(app: (worker_threads: 1), rx: (worker_threads: 1), tx: (handover: app),"
    " net: (handover: app), acc: (handover: app))"
)
"""Zenoh runs on two threads instead of a dozen: a robot has little traffic, and every change of thread takes time.
Receiving has a thread of its own, since it blocks while there is no room for a reply, and the other thread makes room:
with one thread for both, a peer that sent a thousand queries a second blocked an arena for 5 s at a time. Our callbacks
never block, so that two are enough; a router has more traffic, and keeps Zenoh's own threads."""

_LOG_FILTER = "error,zenoh::api::session=off"
"""What Zenoh logs on stderr, unless RUST_LOG is set: without the errors of a session that is being closed."""

_CONGESTION_TIMEOUT_US = 500_000
"""A peer that receives nothing for this long is disconnected: a sample that must not be dropped blocks its sender until
then, and with it all other peers, so this is well below the lease."""

MAX_MESH_ROBOTS = 32
"""Beyond this many robots a full mesh costs more than it gives."""

Session = zenoh.Session
"""An open connection to the network."""


class NetworkSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """How to connect to the network. Endpoints are Zenoh's: `tcp/host:port`, `udp/…`, `tls/…`, `quic/…`."""

    role: Literal["peer", "client", "router"] = "peer"
    connect: tuple[str, ...] = ()
    """Seeds (peer) or routers (client)"""
    listen: tuple[str, ...] = ()
    """Empty: a free port of the address that reaches the first seed"""
    interface: str = ""
    """Network interface on which peers find each other by multicast, without seeds"""
    lease_ms: Annotated[int, Meta(ge=500, le=600_000)] = 3000
    """A silent peer is offline after this"""


def open_session(network: NetworkSettings) -> Session:
    """Connect to the network; raises NetworkError naming the endpoint and the reason."""
    zenoh.init_log_from_env_or(_LOG_FILTER)
    if network.role != "router":
        os.environ.setdefault("ZENOH_RUNTIME", _TWO_THREADS)
    try:
        session = zenoh.open(zenoh.Config.from_json5(json.dumps(zenoh_config(network))))
    except zenoh.ZError as error:
        raise NetworkError(_format_error(network, str(error))) from None
    session.info.declare_link_events_listener(
        Callback(_disable_linger, indirect=False), history=True
    )
    return session


def _disable_linger(_: zenoh.LinkEvent) -> None:
    """Set SO_LINGER of all sockets of this process to 0 (Linux only; elsewhere nothing is done).

    Zenoh sets it to 10 s. So when a cable is cut, closing each of the dead links blocks one of its few threads for
    10 s, and with it the traffic of all other links (eclipse-zenoh/zenoh#1101, #2350).
    """
    if not sys.platform.startswith("linux"):
        return
    for name in os.listdir("/proc/self/fd"):
        with contextlib.suppress(OSError):  # not a socket, or already closed
            open_socket = socket.socket(fileno=int(name))
            try:
                open_socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 0, 0))
            finally:
                open_socket.detach()


def zenoh_config(network: NetworkSettings) -> dict[str, Any]:
    """Return Zenoh's configuration for these settings."""
    by_multicast = bool(network.interface)
    listen = network.listen or _own_endpoints(network)
    return {
        "mode": network.role,
        "listen": {"endpoints": [] if network.role == "client" else list(listen)},
        "connect": {
            "endpoints": list(network.connect),
            "timeout_ms": {"router": -1, "peer": -1, "client": 5000},
            "exit_on_failure": {"router": False, "peer": False, "client": True},
            "retry": {
                "period_init_ms": 100,
                "period_max_ms": 2000,
                "period_increase_factor": 1.7,
            },
        },
        "scouting": {
            "multicast": {
                "enabled": by_multicast,
                "interface": network.interface or "lo",
                "ttl": 1,
                "autoconnect_strategy": {"peer": {"to_router": "always", "to_peer": "always"}},
            },
            "gossip": {"enabled": not by_multicast},
        },
        "transport": {
            "unicast": {
                "open_timeout": 2000,
                "accept_timeout": 2000,
                "accept_pending": 1000,
                "max_sessions": 4096,
            },
            "link": {
                "tx": {
                    "lease": network.lease_ms,
                    "keep_alive": 4,
                    "queue": {
                        "congestion_control": {
                            "block": {"wait_before_close": _CONGESTION_TIMEOUT_US}
                        }
                    },
                },
                "rx": {"max_message_size": 2 * MAX_SCENE_BYTES},
            },
            "shared_memory": {"enabled": False},
        },
        "queries_default_timeout": 2000,
    }


def free_port(host: str = "127.0.0.1") -> int:
    """Return a TCP port of `host` that is not in use now."""
    with socket.socket() as probe:
        probe.bind((host, 0))
        port: int = probe.getsockname()[1]
    return port


def is_taken(endpoint: str) -> bool:
    """Return whether a TCP endpoint of this machine is in use already."""
    host, port = _host_and_port(endpoint)
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except OSError as error:
            return error.errno == errno.EADDRINUSE
    return False


def _own_endpoints(network: NetworkSettings) -> tuple[str, ...]:
    """Return a free port of the own address that reaches the first seed, or of the interface."""
    if network.role == "client":
        return ()
    host = "127.0.0.1"
    if network.connect:
        seed, port = _host_and_port(network.connect[0])
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.connect((seed, port))
                host = probe.getsockname()[0]
            except OSError as error:
                raise NetworkError(f"{network.connect[0]}: {error.strerror or error}") from None
    elif network.interface:
        host = _address_of(network.interface)
    return (f"tcp/{host}:0",)


def _address_of(interface: str) -> str:
    """Return the IPv4 address of a network interface (Linux only).

    Raises NetworkError if there is none, or if the interface is down or has no multicast.
    """
    import fcntl

    siocgifflags, siocgifaddr = 0x8913, 0x8915
    is_up, has_multicast = 0x1, 0x1000
    request = struct.pack("256s", interface[:15].encode())
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            flags = struct.unpack("H", fcntl.ioctl(probe.fileno(), siocgifflags, request)[16:18])[0]
            answer = fcntl.ioctl(probe.fileno(), siocgifaddr, request)
        except OSError as error:
            raise NetworkError(
                f"interface {interface}: {error.strerror}; it needs an IPv4 address"
            ) from None
    if not flags & is_up:
        raise NetworkError(f"interface {interface}: it is down")
    if not flags & has_multicast:
        raise NetworkError(
            f"interface {interface}: it has no multicast; use --connect and --listen instead"
        )
    return socket.inet_ntoa(answer[20:24])


def _host_and_port(endpoint: str) -> tuple[str, int]:
    _, slash, address = endpoint.partition("/")
    host, colon, port = address.rpartition(":")
    is_port = port.isascii() and port.isdigit() and len(port) <= 5 and 0 < int(port) < 65536
    if not slash or not colon or not is_port:
        raise NetworkError(f"{endpoint}: not an endpoint; expected something like {HERE}")
    return host.strip("[]"), int(port)


def _format_error(network: NetworkSettings, reason: str) -> str:
    for endpoint in network.listen:
        if "ddress already in use" in reason or is_taken(endpoint):
            return f"{endpoint}: the port is taken; choose another with --listen"
    if "Cannot assign requested address" in reason:
        return f"{', '.join(network.listen)}: this machine has no such address"
    if network.role == "client":
        return f"no router answers at {', '.join(network.connect) or '(none given)'}"
    short = reason.splitlines()[0].split(" at /")[0]
    return f"{', '.join(network.listen + network.connect) or network.interface}: {short}"
