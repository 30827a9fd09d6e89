"""An endpoint is read as Zenoh reads it, or refused with its name before Zenoh sees it."""

import json
import re

import pytest
import zenoh
from hypothesis import given
from hypothesis import strategies as st

from crcolony.transport.endpoint import Endpoint, parse_endpoint, socket_address
from crcolony.transport.interface import NetworkError

HOSTS = st.one_of(
    st.ip_addresses(v=4).map(str),
    st.ip_addresses(v=6).map(str),
    st.from_regex(r"[a-z][a-z0-9-]{0,10}(\.[a-z0-9]{1,5}){0,2}", fullmatch=True),
)
METADATA = st.sampled_from(["", "?rel=0", "?rel=1", "?prio=1-5", "?prio=1-5;rel=1"])
CONFIGS = st.sampled_from(["", "#iface=eth0", "#iface=eth0;bind=10.0.0.1:0"])


def is_known_to_zenoh(text: str) -> bool:
    """Return whether Zenoh accepts an endpoint in its configuration."""
    try:
        zenoh.Config.from_json5(json.dumps({"connect": {"endpoints": [text]}}))
    except zenoh.ZError:
        return False
    return True


@given(
    st.sampled_from(["tcp", "udp", "quic", "tls", "ws"]),
    HOSTS,
    st.integers(0, 65535),
    METADATA,
    CONFIGS,
)
def test_every_endpoint_of_a_host_is_read_and_written_alike(
    protocol: str, host: str, port: int, metadata: str, config: str
) -> None:
    """IPv4, IPv6 and names, with Zenoh's metadata and configuration; and Zenoh knows it, too."""
    text = f"{protocol}/{socket_address(host, port)}{metadata}{config}"
    endpoint = parse_endpoint(text, to_listen=True)
    assert (endpoint.protocol, endpoint.host, endpoint.port) == (protocol, host, port)
    assert endpoint.interface == ("eth0" if config else "")
    assert str(endpoint) == text
    assert is_known_to_zenoh(text)


@given(
    st.one_of(
        st.text(max_size=40),
        st.from_regex(
            r"(tcp|udp|unixsock-stream|foo)/?[\[\]:a-f0-9./?#=;%*-]{0,20}", fullmatch=True
        ),
    )
)
def test_any_text_is_an_endpoint_of_zenoh_or_refused_by_name(text: str) -> None:
    """Nothing else is raised, and what is accepted is read as it stands."""
    try:
        endpoint = parse_endpoint(text)
    except NetworkError as error:
        message = str(error)
    else:
        message = f"{text}: accepted"
        assert str(endpoint) == text
        assert is_known_to_zenoh(text)
    assert message.startswith(text)


def test_a_unix_socket_is_a_path() -> None:
    """It has no host and no port."""
    endpoint = parse_endpoint("unixsock-stream//run/colony 1.sock")
    assert endpoint == Endpoint("unixsock-stream", "/run/colony 1.sock")


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("127.0.0.1:7447", "not an endpoint; expected something like tcp/"),
        ("tcp/host", "not an endpoint"),
        ("tcp/host:99999", "not an endpoint"),
        ("tcp/host:0", "not an endpoint to connect to"),
        ("tcp/:7447", "not an endpoint"),
        ("tcp/*:7447", "not an endpoint"),
        ("foo/host:1", "not an endpoint"),
        ("unixsock-stream/", "not an endpoint"),
        ("tcp/::1:7447", "an IPv6 address stands in brackets"),
        ("tcp/[host]:7447", "host is no IPv6 address"),
        ("tcp/[fe80::1%eth0]:7447", "the number of the interface"),
        ("serial//dev/ttyS0#baudrate=9600", "Zenoh's Python package has no serial links"),
        ("vsock/1:2", "Zenoh's Python package has no vsock links"),
        ("tcp/host:1?rel", "after \\? stands rel=0"),
        ("tcp/host:1#iface", "after # stands KEY=VALUE"),
    ],
)
def test_what_is_no_endpoint_is_refused_by_name(text: str, reason: str) -> None:
    """With what is wrong with it."""
    with pytest.raises(NetworkError, match=f"^{re.escape(text)}: .*{reason}"):
        parse_endpoint(text)
