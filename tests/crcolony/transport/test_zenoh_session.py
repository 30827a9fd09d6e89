"""How a process connects follows from its settings; what is wrong with them is named in one line."""

import socket

import pytest

from crcolony.transport.interface import NetworkError
from crcolony.transport.zenoh_session import (
    NetworkSettings,
    free_port,
    is_taken,
    open_session,
    zenoh_config,
)


def test_a_peer_listens_on_a_free_port_of_the_address_that_reaches_its_seed() -> None:
    """And finds the others by gossip."""
    config = zenoh_config(NetworkSettings(connect=("tcp/127.0.0.1:7447",)))
    assert config["mode"] == "peer"
    assert config["connect"]["endpoints"] == ["tcp/127.0.0.1:7447"]
    assert config["listen"]["endpoints"] == ["tcp/127.0.0.1:0"]
    assert config["scouting"]["gossip"]["enabled"]
    assert not config["scouting"]["multicast"]["enabled"]


def test_a_client_does_not_listen() -> None:
    """It connects to routers only."""
    config = zenoh_config(NetworkSettings(role="client", connect=("tcp/127.0.0.1:7447",)))
    assert (config["mode"], config["listen"]["endpoints"]) == ("client", [])


def test_peers_of_an_interface_find_each_other_by_multicast() -> None:
    """One mechanism of discovery is on, never both."""
    network = NetworkSettings(interface="eth0", listen=("tcp/127.0.0.1:0",))
    scouting = zenoh_config(network)["scouting"]
    assert scouting["multicast"]["enabled"]
    assert scouting["multicast"]["interface"] == "eth0"
    assert not scouting["gossip"]["enabled"]


@pytest.mark.parametrize("endpoint", ["127.0.0.1:7447", "tcp/host", "tcp/host:0", "tcp/host:99999"])
def test_an_endpoint_that_is_none_is_named(endpoint: str) -> None:
    """With an example of one that is."""
    with pytest.raises(NetworkError, match="not an endpoint; expected something like tcp/"):
        zenoh_config(NetworkSettings(connect=(endpoint,)))


@pytest.mark.parametrize(
    ("interface", "reason"), [("none0", "it needs an IPv4 address"), ("lo", "has no multicast")]
)
def test_an_interface_without_address_or_multicast_is_named(interface: str, reason: str) -> None:
    """Peers could not find each other there."""
    with pytest.raises(NetworkError, match=f"interface {interface}: .*{reason}"):
        zenoh_config(NetworkSettings(interface=interface))


def test_a_port_in_use_is_named() -> None:
    """With the option that chooses another."""
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        endpoint = f"tcp/127.0.0.1:{other.getsockname()[1]}"
        assert is_taken(endpoint)
        with pytest.raises(NetworkError, match="the port is taken; choose another with --listen"):
            open_session(NetworkSettings(listen=(endpoint,)))
    assert not is_taken(endpoint)


def test_a_client_without_a_router_is_refused() -> None:
    """The endpoint at which none answers is named."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with pytest.raises(NetworkError, match=f"no router answers at {endpoint}"):
        open_session(NetworkSettings(role="client", connect=(endpoint,)))
