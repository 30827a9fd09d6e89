"""Metrics are served over HTTP at one address alone, and no client can keep others from them."""

import contextlib
import socket
import urllib.request

import pytest
from crcolony_deploy.metrics_server import MAX_CLIENTS, MetricsError, parse_address, serving
from prometheus_client.registry import CollectorRegistry


@pytest.mark.parametrize(
    "text",
    ["", "x", "9464", ":9464", "127.0.0.1", "127.0.0.1:-1", "h:65536", "h:٣", "h:" + "9" * 30],
)
def test_what_is_no_address_is_refused(text: str) -> None:
    """In one line that shows what is expected."""
    with pytest.raises(MetricsError, match="expected an address and a port"):
        parse_address(text)


def test_addresses_of_both_families_are_understood() -> None:
    """An IPv6 address stands in brackets."""
    assert parse_address("127.0.0.1:9464") == ("127.0.0.1", 9464)
    assert parse_address("[::1]:9464") == ("::1", 9464)


def test_a_port_in_use_is_said() -> None:
    """And nothing is served."""
    with socket.create_server(("127.0.0.1", 0)) as taken:
        address = f"127.0.0.1:{taken.getsockname()[1]}"
        with pytest.raises(MetricsError, match="in use"), serving(CollectorRegistry(), address):
            pass


def test_clients_that_only_connect_do_not_keep_others_out_for_long() -> None:
    """As many as there is room for hold their connections and say nothing: they are cut off, and others are served."""
    with contextlib.ExitStack() as opened:
        url = opened.enter_context(serving(CollectorRegistry(), "127.0.0.1:0"))
        where = parse_address(url.removeprefix("http://").removesuffix("/metrics"))
        silent = [
            opened.enter_context(socket.create_connection(where)) for _ in range(3 * MAX_CLIENTS)
        ]
        for client in silent:
            client.settimeout(30.0)
            assert client.recv(1) == b"", "the server has closed it"
        with urllib.request.urlopen(url, timeout=10.0) as reply:
            assert reply.status == 200
