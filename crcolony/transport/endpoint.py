"""Endpoints in Zenoh's syntax, `<protocol>/<address>[?<metadata>][#<config>]`, read and checked before Zenoh sees them.

Zenoh itself takes much that can never connect without a word (a port that is none, a link that its build lacks), and
some of it ends the process.
"""

import ipaddress
import re
from typing import NamedTuple

from crcolony.transport.interface import NetworkError

STREAMS = frozenset({"tcp", "tls", "ws"})
"""Protocols over TCP."""
DATAGRAMS = frozenset({"udp", "quic"})
"""Protocols over UDP."""
ENCRYPTED = frozenset({"quic", "tls"})
"""Protocols in which both ends can show a certificate."""
UNIX_SOCKET = "unixsock-stream"
"""A socket in the file system; its address is a path."""
_NOT_BUILT = frozenset({"serial", "unixpipe", "vsock", "quic_datagram"})
"""Protocols of Zenoh that its Python package has not."""

_EXAMPLE = "expected something like tcp/10.0.0.1:7447 or tcp/[fe80::1]:7447"
_HOST_NAME = re.compile(r"[^\s\[\]:/?#*,;=]+")
_METADATA = re.compile(r"(rel=[01]|prio=[0-7](-[0-7])?)(;(rel=[01]|prio=[0-7](-[0-7])?))*")
"""Reliability and priorities: anything else makes Zenoh panic when it opens the link."""
_CONFIG = re.compile(r"[^\s;=?]+=[^;?]*(;[^\s;=?]+=[^;?]*)*")


class Endpoint(NamedTuple):
    """An endpoint that is well-formed. `host` and `port` are empty and 0 for a Unix socket, whose path is `address`."""

    protocol: str
    address: str
    host: str = ""
    """Name or address, IPv6 without brackets"""
    port: int = 0
    """0: any that is free, of an endpoint to listen on"""
    metadata: str = ""
    config: str = ""

    def __str__(self) -> str:
        metadata = f"?{self.metadata}" if self.metadata else ""
        config = f"#{self.config}" if self.config else ""
        return f"{self.protocol}/{self.address}{metadata}{config}"

    @property
    def interface(self) -> str:
        """The network interface to which the link is bound; empty: any."""
        settings = (pair.partition("=") for pair in self.config.split(";"))
        return next((value for key, _, value in settings if key == "iface"), "")


def parse_endpoint(text: str, *, to_listen: bool = False) -> Endpoint:
    """Return an endpoint to connect to, or to listen on, whose port may be 0: any that is free.

    Raises NetworkError that names the endpoint and what is wrong with it.
    """
    rest, has_config, config = text.partition("#")
    rest, has_metadata, metadata = rest.partition("?")
    protocol, slash, address = rest.partition("/")
    if protocol in _NOT_BUILT and slash:
        raise NetworkError(f"{text}: Zenoh's Python package has no {protocol} links")
    if protocol not in STREAMS | DATAGRAMS | {UNIX_SOCKET} or not slash or not address:
        raise NetworkError(f"{text}: not an endpoint; {_EXAMPLE}")
    if has_metadata and not _METADATA.fullmatch(metadata):
        raise NetworkError(f"{text}: after ? stands rel=0, rel=1 or prio=0-7")
    if has_config and not _CONFIG.fullmatch(config):
        raise NetworkError(f"{text}: after # stands KEY=VALUE, as in #iface=eth0")
    if protocol == UNIX_SOCKET:
        return Endpoint(protocol, address, metadata=metadata, config=config)
    host, port = _host_and_port(text, address)
    if port == 0 and not to_listen:
        raise NetworkError(f"{text}: not an endpoint to connect to; its port is 0")
    return Endpoint(protocol, address, host, port, metadata, config)


def socket_address(host: str, port: int) -> str:
    """Return host and port as an endpoint has them: IPv6 in brackets."""
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def _host_and_port(text: str, address: str) -> tuple[str, int]:
    host, colon, port = address.rpartition(":")
    is_port = port.isascii() and port.isdigit() and len(port) <= 5 and int(port) < 65536
    if not colon or not is_port:
        raise NetworkError(f"{text}: not an endpoint; {_EXAMPLE}")
    if host.startswith("[") and host.endswith("]"):
        return _ipv6(text, host[1:-1]), int(port)
    if ":" in host:
        raise NetworkError(f"{text}: an IPv6 address stands in brackets, as in tcp/[::1]:7447")
    if not _HOST_NAME.fullmatch(host):
        raise NetworkError(f"{text}: not an endpoint; {_EXAMPLE}")
    return host, int(port)


def _ipv6(text: str, host: str) -> str:
    try:
        scope = ipaddress.IPv6Address(host).scope_id
    except ValueError:
        raise NetworkError(f"{text}: {host} is no IPv6 address") from None
    if scope is not None and not (scope.isascii() and scope.isdigit()):
        raise NetworkError(
            f"{text}: after % stands the number of the interface (ip link), not its name"
        )
    return host
