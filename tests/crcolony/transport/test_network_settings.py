"""What is exposed beyond this machine is known, and credentials have encrypted endpoints."""

from pathlib import Path

import pytest

from crcolony.transport.interface import NetworkError
from crcolony.transport.network_settings import (
    NetworkSettings,
    check_endpoints,
    exposed_endpoints,
)


def test_what_only_this_machine_reaches_is_not_exposed() -> None:
    """Loopback addresses of both kinds, its name, and a socket in the file system."""
    network = NetworkSettings(
        connect=("tcp/127.0.0.1:1", "tcp/[::1]:1", "tcp/localhost:1", "tcp/127.9.9.9:1"),
        listen=("unixsock-stream//run/colony",),
        interface="lo",
    )
    assert list(exposed_endpoints(network)) == []


@pytest.mark.parametrize(
    "endpoint", ["tcp/10.0.0.1:1", "tcp/0.0.0.0:1", "udp/[::]:1", "tcp/colony.example:1"]
)
def test_everything_else_is_exposed(endpoint: str) -> None:
    """Where it listens, and where it connects: what it says there can be read."""
    assert list(exposed_endpoints(NetworkSettings(connect=(endpoint,)))) == [endpoint]
    assert list(exposed_endpoints(NetworkSettings(listen=(endpoint,)))) == [endpoint]
    assert list(exposed_endpoints(NetworkSettings(interface="eth0"))) == ["interface eth0"]


def test_credentials_are_not_shown_in_plain_text() -> None:
    """An endpoint that is not encrypted is refused by name."""
    for endpoint in ("tls/10.0.0.1:1", "quic/10.0.0.1:1"):
        check_endpoints(NetworkSettings(connect=(endpoint,), credentials=Path("x")))
    with pytest.raises(NetworkError, match=r"tcp/10\.0\.0\.1:1: with credentials every endpoint"):
        check_endpoints(NetworkSettings(listen=("tcp/10.0.0.1:1",), credentials=Path("x")))
