"""How a process connects follows from its settings; what is wrong with them is named in one line."""

import socket
from pathlib import Path

import pytest

from crcolony.transport.endpoint import socket_address
from crcolony.transport.interface import NetworkError, NetworkUnavailableError
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import (
    check_network,
    free_port,
    has_links,
    is_taken,
    open_session,
)
from tests.support.process import wait_until


@pytest.mark.parametrize("endpoint", ["127.0.0.1:7447", "tcp/host", "tcp/host:0", "tcp/host:99999"])
def test_an_endpoint_that_is_none_is_named(endpoint: str) -> None:
    """Before anything is looked up or opened."""
    with pytest.raises(NetworkError, match=f"^{endpoint}: not an endpoint"):
        check_network(NetworkSettings(connect=(endpoint,)))


@pytest.mark.parametrize("host", ["127.0.0.1", "::1"])
@pytest.mark.parametrize("protocol", ["tcp", "ws", "udp"])
def test_a_port_in_use_is_named(protocol: str, host: str) -> None:
    """With the option that chooses another; over IPv4 and IPv6, TCP and UDP."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    kind = socket.SOCK_DGRAM if protocol == "udp" else socket.SOCK_STREAM
    with socket.socket(family, kind) as other:
        other.bind((host, 0))
        if kind == socket.SOCK_STREAM:
            other.listen()
        endpoint = f"{protocol}/{socket_address(host, other.getsockname()[1])}"
        assert is_taken(endpoint)
        with pytest.raises(NetworkError, match="the port is taken; choose another with --listen"):
            open_session(NetworkSettings(listen=(endpoint,)))
    assert not is_taken(endpoint)


def test_a_unix_socket_in_use_is_taken(tmp_path: Path) -> None:
    """By a process that listens on it."""
    endpoint = f"unixsock-stream/{tmp_path / 'colony'}"
    assert not is_taken(endpoint)
    with open_session(NetworkSettings(listen=(endpoint,))):
        assert is_taken(endpoint)


def test_an_address_that_this_machine_has_not_may_come_later() -> None:
    """A listen address, a name of one, and an interface to which it is bound."""
    for endpoint, reason in (
        ("tcp/192.0.2.1:7447", "this machine has no such address"),
        ("tcp/nobody.invalid:7447", "its name is unknown"),
        ("tcp/127.0.0.1:0#iface=none0", "no such interface"),
    ):
        with pytest.raises(NetworkUnavailableError, match=f"{endpoint}: {reason}"):
            open_session(NetworkSettings(listen=(endpoint,)))


@pytest.mark.parametrize("protocol", ["tcp", "udp", "ws", "unixsock-stream"])
@pytest.mark.parametrize("host", ["127.0.0.1", "[::1]"])
def test_two_processes_connect_over_every_link(tmp_path: Path, protocol: str, host: str) -> None:
    """Without settings of their own; TLS and QUIC need certificates, given after # as Zenoh has it."""
    address = str(tmp_path / "s") if protocol == "unixsock-stream" else f"{host}:{free_port()}"
    endpoint = f"{protocol}/{address}"
    with (
        open_session(NetworkSettings(listen=(endpoint,))) as one,
        open_session(NetworkSettings(connect=(endpoint,))) as other,
    ):
        wait_until(lambda: has_links(one) and has_links(other), f"a link over {endpoint}")


def test_a_listener_without_its_certificate_is_refused_by_name() -> None:
    """Over TLS and QUIC."""
    for protocol in ("tls", "quic"):
        with pytest.raises(NetworkError, match=f"^{protocol}/127.0.0.1:0: .*Missing TLS"):
            open_session(NetworkSettings(listen=(f"{protocol}/127.0.0.1:0",)))


def test_a_closed_session_has_no_links() -> None:
    """Asking is no error."""
    session = open_session(NetworkSettings(listen=("tcp/127.0.0.1:0",)))
    session.close()  # type: ignore[no-untyped-call]
    assert not has_links(session)


def test_a_client_without_a_router_is_refused() -> None:
    """The endpoint at which none answers is named, and why."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    reason = f"no router answers at {endpoint} .connection refused."
    with pytest.raises(NetworkUnavailableError, match=reason):
        open_session(NetworkSettings(role="client", connect=(endpoint,)))
