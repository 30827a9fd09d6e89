"""How a process is to connect to the network: with whom, where it listens, and with which credentials."""

import ipaddress
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from crcolony.transport.endpoint import ENCRYPTED, UNIX_SOCKET, parse_endpoint
from crcolony.transport.interface import NetworkError

PORT = 7447
HERE = f"tcp/127.0.0.1:{PORT}"
"""Default endpoint, where the processes of one machine find each other."""
HERE_ENCRYPTED = f"tls/127.0.0.1:{PORT}"
"""The same of processes with credentials."""

MAX_MESH_ROBOTS = 32
"""Beyond this many robots a full mesh costs more than it gives."""

_LOOPBACK_INTERFACE = "lo"


class NetworkSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """How to connect to the network, with endpoints as Zenoh has them (`endpoint.py`)."""

    role: Literal["peer", "client", "router"] = "peer"
    connect: tuple[str, ...] = ()
    """Seeds (peer) or routers (client)"""
    listen: tuple[str, ...] = ()
    """Empty: a free port of the address that reaches the first seed"""
    interface: str = ""
    """Network interface on which peers find each other by multicast, without seeds"""
    lease_ms: Annotated[int, Meta(ge=500, le=600_000)] = 3000
    """A silent peer is offline after this"""
    credentials: Path | None = None
    """Folder of this member of a deployment; None: nobody proves who they are"""
    is_open: bool = False
    """Whether that is meant, beyond this machine"""


def check_endpoints(network: NetworkSettings) -> None:
    """Raise NetworkError that names the first text that is no endpoint."""
    for endpoint in network.connect:
        parse_endpoint(endpoint)
    for endpoint in network.listen:
        parse_endpoint(endpoint, to_listen=True)
    if network.credentials is None:
        return
    for endpoint in network.connect + network.listen:
        if parse_endpoint(endpoint, to_listen=True).protocol not in ENCRYPTED:
            raise NetworkError(f"{endpoint}: with credentials every endpoint is tls/HOST:PORT")


def exposed_endpoints(network: NetworkSettings) -> Iterator[str]:
    """Yield what others than the processes of this machine can reach, or are reached by."""
    for text in network.connect + network.listen:
        endpoint = parse_endpoint(text, to_listen=True)
        if endpoint.protocol != UNIX_SOCKET and not _is_loopback(endpoint.host):
            yield text
    if network.interface not in ("", _LOOPBACK_INTERFACE):
        yield f"interface {network.interface}"


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:  # a name: what it means may change
        return host == "localhost"
