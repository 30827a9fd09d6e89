"""Zenoh's configuration follows from the settings of a network; what is wrong with them is named in one line."""

from pathlib import Path

import pytest

from crcolony.protocol.identity import Identity
from crcolony.transport.interface import NetworkError, NetworkUnavailableError
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_config import zenoh_config
from tests.support.deployment import Deployment


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


def test_a_peer_listens_on_the_address_of_the_first_seed_to_which_there_is_a_way() -> None:
    """Over IPv6 where the seed is, and on this machine for a Unix socket."""
    for seeds, listen in (
        (("tcp/[::1]:7447",), "tcp/[::1]:0"),
        (("tcp/nobody.invalid:7447", "tcp/127.0.0.1:7447#iface=lo"), "tcp/127.0.0.1:0"),
        (("unixsock-stream//run/colony",), "tcp/127.0.0.1:0"),
    ):
        assert zenoh_config(NetworkSettings(connect=seeds))["listen"]["endpoints"] == [listen]
    with pytest.raises(NetworkUnavailableError, match=r"tcp/nobody.invalid:7447: its name "):
        zenoh_config(NetworkSettings(connect=("tcp/nobody.invalid:7447",)))


@pytest.mark.parametrize(
    ("interface", "reason"), [("none0", "it needs an IPv4 address"), ("lo", "has no multicast")]
)
def test_an_interface_without_address_or_multicast_is_named(interface: str, reason: str) -> None:
    """Peers could not find each other there."""
    with pytest.raises(NetworkError, match=f"interface {interface}: .*{reason}"):
        zenoh_config(NetworkSettings(interface=interface))


@pytest.mark.parametrize("role", ["peer", "client", "router"])
def test_with_credentials_nothing_is_in_plain_text_and_nobody_is_unknown(
    tmp_path: Path, role: str
) -> None:
    """Both ends show certificates, and what is not allowed is denied."""
    folder = Deployment(tmp_path).member("robot", "kitchen", Identity(bytes(32)))
    seeds = ("tls/127.0.0.1:7447",)
    network = NetworkSettings(role=role, connect=seeds, credentials=folder)  # type: ignore[arg-type]
    config = zenoh_config(network)
    link = config["transport"]["link"]
    assert link["protocols"] == ["quic", "tls"]
    assert link["tls"]["enable_mtls"] is True
    assert link["tx"]["lease"] == 3000
    assert config["access_control"]["enabled"] is True
    assert config["access_control"]["default_permission"] == "deny"
    if role == "peer":
        assert config["listen"]["endpoints"] == ["tls/127.0.0.1:0"]


def test_credentials_that_are_none_are_named(tmp_path: Path) -> None:
    """Before anything is opened."""
    with pytest.raises(NetworkError, match="missing; crcolony enroll"):
        zenoh_config(NetworkSettings(connect=("tls/127.0.0.1:1",), credentials=tmp_path))
