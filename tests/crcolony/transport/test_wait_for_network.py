"""A process that starts before its network waits, says so once, and goes on when the network is there."""

import socket
import threading

import pytest

from crcolony.transport.interface import NetworkError
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.wait_for_network import wait_for_session
from crcolony.transport.zenoh_session import free_port, open_session
from tests.support.process import wait_until

NEVER = lambda: False  # noqa: E731


def test_a_client_waits_for_its_router() -> None:
    """And names it while it is not there, in one line."""
    endpoint, lines = f"tcp/127.0.0.1:{free_port()}", list[str]()
    found: list[object] = []

    def wait() -> None:
        network = NetworkSettings(role="client", connect=(endpoint,))
        found.append(wait_for_session(network, NEVER, lines.append))

    waiting = threading.Thread(target=wait)
    waiting.start()
    wait_until(lambda: lines, "it says that it waits")
    with open_session(NetworkSettings(role="router", listen=(endpoint,))):
        waiting.join(30.0)
        assert lines == [
            f"waiting for the network: no router answers at {endpoint} (connection refused)",
            "the network is there",
        ]
        (session,) = found
        session.close()  # type: ignore[attr-defined]


def test_a_shutdown_ends_the_wait() -> None:
    """Without a session."""
    lines = list[str]()
    network = NetworkSettings(connect=("tcp/nobody.invalid:7447",))
    assert wait_for_session(network, lambda: bool(lines), lines.append) is None
    assert lines[0].startswith("waiting for the network: tcp/nobody.invalid:7447: its name ")


@pytest.mark.parametrize(
    "network",
    [
        NetworkSettings(connect=("tcp/host",)),
        NetworkSettings(role="client", connect=("foo/host:1",)),
        NetworkSettings(listen=("tcp/[x]:1",)),
        NetworkSettings(interface="lo"),
    ],
)
def test_what_can_never_be_used_is_refused_at_once(network: NetworkSettings) -> None:
    """Waiting would not help."""
    with pytest.raises(NetworkError):
        wait_for_session(network, NEVER, pytest.fail)


def test_a_port_in_use_is_refused_at_once() -> None:
    """It belongs to another program, which will not go by itself."""
    with socket.create_server(("127.0.0.1", 0)) as other:
        network = NetworkSettings(listen=(f"tcp/127.0.0.1:{other.getsockname()[1]}",))
        with pytest.raises(NetworkError, match="the port is taken"):
            wait_for_session(network, NEVER, pytest.fail)
