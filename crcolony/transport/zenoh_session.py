"""Opens connections to the network, and says in one line why one cannot be opened."""

import contextlib
import errno
import json
import os
import socket
import struct
import sys
from collections.abc import Iterator

import zenoh
from zenoh.handlers import Callback

from crcolony.protocol.key_expressions import observer
from crcolony.transport.endpoint import DATAGRAMS, UNIX_SOCKET, parse_endpoint
from crcolony.transport.interface import NetworkError, NetworkUnavailableError
from crcolony.transport.network_settings import NetworkSettings, check_endpoints
from crcolony.transport.open_files import allow_open_files
from crcolony.transport.reachability import reason_unreachable
from crcolony.transport.zenoh_config import zenoh_config

_TWO_THREADS = (
    "(app: (worker_threads: 1), rx: (worker_threads: 1), tx: (handover: app),"
    " net: (handover: app), acc: (handover: app))"
)
"""Zenoh runs on two threads instead of a dozen: a robot has little traffic, and every change of thread takes time.
Receiving has a thread of its own, since it blocks while there is no room for a reply, and the other thread makes room:
with one thread for both, a peer that sent a thousand queries a second blocked an arena for 5 s at a time. Our callbacks
never block, so that two are enough; a router has more traffic, and keeps Zenoh's own threads."""

_LOG_FILTER = "off"
"""What Zenoh logs, unless RUST_LOG is set: what a user has to know, commands say in their own words."""

_PROBE_TIMEOUT_S = 2.0
"""How long a router may take to accept a connection."""

_NOT_YET = {
    "Cannot assign requested address": "this machine has no such address",
    "failed to lookup address": "its name is unknown",
    "No such device": "no such interface",
}
"""What Zenoh says of endpoints to listen on that may exist later, and what it means."""

Session = zenoh.Session
"""An open connection to the network."""


def open_session(network: NetworkSettings) -> Session:
    """Connect to the network; raises NetworkError naming the endpoint and the reason.

    A peer's seeds need not answer yet. NetworkUnavailableError: it may succeed later (`wait_for_network.py`).
    """
    allow_open_files()
    zenoh.init_log_from_env_or(_LOG_FILTER)
    if network.role != "router":
        os.environ.setdefault("ZENOH_RUNTIME", _TWO_THREADS)
    check_network(network)
    try:
        session = zenoh.open(zenoh.Config.from_json5(json.dumps(zenoh_config(network))))
    except zenoh.ZError as error:
        raise _network_error(network, str(error)) from None
    session.info.declare_link_events_listener(
        Callback(_disable_linger, indirect=False), history=True
    )
    return session


def has_links(session: Session) -> bool:
    """Return whether the session is connected to any other process."""
    return bool(sessions_of_peers(session))


def sessions_of_peers(session: Session) -> set[str]:
    """Return the sessions to which one is connected: none once it is closed."""
    try:
        return {str(zid) for zid in (*session.info.peers_zid(), *session.info.routers_zid())}
    except zenoh.ZError:
        return set()


@contextlib.contextmanager
def declared_as_observer(session: Session) -> Iterator[None]:
    """Have a liveliness token inside the context, as a process that starts has no other yet.

    Peers report a process without a token as another program (`liveliness_check.py`).
    """
    token = session.liveliness().declare_token(observer(str(session.zid())))
    try:
        yield
    finally:
        token.undeclare()  # type: ignore[no-untyped-call]


def check_network(network: NetworkSettings) -> None:
    """Raise NetworkError for wrong settings, NetworkUnavailableError if they cannot be used now; may take seconds."""
    check_endpoints(network)
    zenoh_config(network)
    if network.role == "client":
        reasons = [reason_unreachable(parse_endpoint(e), _PROBE_TIMEOUT_S) for e in network.connect]
        if all(reasons):
            tried = ", ".join(
                f"{endpoint} ({reason})"
                for endpoint, reason in zip(network.connect, reasons, strict=True)
            )
            raise NetworkUnavailableError(f"no router answers at {tried or '(none given)'}")


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


def free_port(host: str = "127.0.0.1") -> int:
    """Return a TCP port of an address of this machine that is not in use now."""
    with socket.socket(_family(host)) as probe:
        probe.bind((host, 0))
        port: int = probe.getsockname()[1]
    return port


def is_taken(endpoint: str) -> bool:
    """Return whether another process of this machine listens on an endpoint; raises NetworkError if it is none."""
    parsed = parse_endpoint(endpoint, to_listen=True)
    if parsed.protocol == UNIX_SOCKET:
        return not reason_unreachable(parsed, _PROBE_TIMEOUT_S)
    kind = socket.SOCK_DGRAM if parsed.protocol in DATAGRAMS else socket.SOCK_STREAM
    with socket.socket(_family(parsed.host), kind) as probe:
        if kind == socket.SOCK_STREAM:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((parsed.host, parsed.port))
        except OSError as error:
            return error.errno == errno.EADDRINUSE
    return False


def _family(host: str) -> socket.AddressFamily:
    return socket.AF_INET6 if ":" in host else socket.AF_INET


def _network_error(network: NetworkSettings, reason: str) -> NetworkError:
    """Return what an error of Zenoh means for the user."""
    listen = ", ".join(network.listen)
    for endpoint in network.listen:
        if "ddress already in use" in reason or is_taken(endpoint):
            return NetworkError(f"{endpoint}: the port is taken; choose another with --listen")
    for text, meaning in _NOT_YET.items():
        if text in reason and network.listen:
            return NetworkUnavailableError(f"{listen}: {meaning}")
    if network.role == "client":
        return NetworkUnavailableError(
            f"what answers at {', '.join(network.connect)} is no Zenoh router"
        )
    short = reason.splitlines()[0].split(" at /")[0]
    where = ", ".join(network.listen + network.connect) or network.interface
    return NetworkError(f"{where}: {short}")
