"""Whether somebody answers at an endpoint, why not, and by which address of this machine it is reached."""

import socket
from pathlib import Path

import pytest

from crcolony.transport.endpoint import parse_endpoint, socket_address
from crcolony.transport.interface import NetworkError, NetworkUnavailableError
from crcolony.transport.reachability import (
    address_of_interface,
    own_address_towards,
    reason_unreachable,
)
from crcolony.transport.zenoh_session import free_port


def reason(endpoint: str) -> str:
    return reason_unreachable(parse_endpoint(endpoint), timeout_s=1.0)


@pytest.mark.parametrize("host", ["127.0.0.1", "::1", "localhost"])
def test_somebody_answers_where_a_process_listens(host: str) -> None:
    """Over IPv4, over IPv6, and by name."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.create_server((host, 0), family=family) as server:
        address = socket_address(host, server.getsockname()[1])
        for protocol in ("tcp", "tls", "ws", "udp"):
            assert reason(f"{protocol}/{address}") == ""


def test_a_unix_socket_answers_where_a_process_listens(tmp_path: Path) -> None:
    """Otherwise there is no such socket."""
    path = tmp_path / "s"
    assert reason(f"unixsock-stream/{path}") == "no such socket"
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(path))
        server.listen()
        assert reason(f"unixsock-stream/{path}") == ""


def test_why_nobody_answers_is_named() -> None:
    """Refused, a name that nobody has, an interface that is not there."""
    assert reason(f"tcp/127.0.0.1:{free_port()}") == "connection refused"
    assert reason(f"tcp/[::1]:{free_port('::1')}") == "connection refused"
    assert reason("tcp/nobody.invalid:7447").startswith("its name ")
    assert reason("udp/nobody.invalid:7447").startswith("its name ")
    assert reason("tcp/127.0.0.1:7447#iface=none0") == "no such interface"


@pytest.mark.parametrize(
    ("endpoint", "address"),
    [
        ("tcp/127.0.0.1:7447", "127.0.0.1"),
        ("tcp/[::1]:7447", "::1"),
        ("udp/127.0.0.1:7447#iface=lo", "127.0.0.1"),
        ("unixsock-stream//run/colony", "127.0.0.1"),
    ],
)
def test_the_own_address_is_that_of_the_way_to_an_endpoint(endpoint: str, address: str) -> None:
    """Of the same family; a Unix socket is on this machine."""
    assert own_address_towards(parse_endpoint(endpoint)) == address


def test_an_interface_that_may_come_is_told_from_one_that_cannot_do() -> None:
    """The loopback has no multicast; one that is not there may be plugged in later."""
    with pytest.raises(
        NetworkUnavailableError, match=r"interface none0: .*it needs an IPv4 address"
    ):
        address_of_interface("none0")
    with pytest.raises(NetworkError, match="interface lo: it has no multicast") as refused:
        address_of_interface("lo")
    assert not isinstance(refused.value, NetworkUnavailableError)
