"""The configuration of Zenoh that follows from the settings of a network.

Up to about 32 robots a full mesh is the simplest; beyond, robots are clients of one or more interchangeable routers,
which hold no state. Only the configuration differs. Zenoh's defaults that do harm here are replaced: shared memory is
off, there is one mechanism of discovery, leases are short, and sizes are limited.
"""

import json
from typing import Any

from crcolony.protocol.codec import MAX_SCENE_BYTES
from crcolony.transport.credentials import Credentials, load_credentials
from crcolony.transport.endpoint import ENCRYPTED, parse_endpoint, socket_address
from crcolony.transport.interface import NetworkUnavailableError
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.reachability import (
    address_of_interface,
    format_reason,
    own_address_towards,
)

_CONGESTION_TIMEOUT_US = 500_000
"""A peer that receives nothing for this long is disconnected: a sample that must not be dropped blocks its sender until
then, and with it all other peers, so this is well below the lease."""


def zenoh_config(network: NetworkSettings) -> dict[str, Any]:
    """Return Zenoh's configuration for these settings; raises NetworkError, also for credentials that are none."""
    by_multicast = bool(network.interface)
    listen = network.listen or _own_endpoints(network)
    config: dict[str, Any] = {
        "mode": network.role,
        "listen": {"endpoints": [] if network.role == "client" else list(listen)},
        "connect": {
            "endpoints": list(network.connect),
            "timeout_ms": {"router": -1, "peer": -1, "client": 5000},
            "exit_on_failure": {"router": False, "peer": False, "client": True},
            "retry": {
                "period_init_ms": 100,
                "period_max_ms": 2000,
                "period_increase_factor": 1.7,
            },
        },
        "scouting": {
            "multicast": {
                "enabled": by_multicast,
                "interface": network.interface or "lo",
                "ttl": 1,
                "autoconnect_strategy": {"peer": {"to_router": "always", "to_peer": "always"}},
            },
            "gossip": {"enabled": not by_multicast},
        },
        "transport": {
            "unicast": {
                "open_timeout": 2000,
                "accept_timeout": 2000,
                "accept_pending": 1000,
                "max_sessions": 4096,
            },
            "link": {
                "tx": {
                    "lease": network.lease_ms,
                    "keep_alive": 4,
                    "queue": {
                        "congestion_control": {
                            "block": {"wait_before_close": _CONGESTION_TIMEOUT_US}
                        }
                    },
                },
                "rx": {"max_message_size": 2 * MAX_SCENE_BYTES},
            },
            "shared_memory": {"enabled": False},
        },
        "queries_default_timeout": 2000,
    }
    if network.credentials is not None:
        _secure(config, load_credentials(network.credentials))
    return config


def print_config(network: NetworkSettings) -> None:
    """Print the configuration as Zenoh reads it, in JSON."""
    print(json.dumps(zenoh_config(network), indent=2))


def _secure(config: dict[str, Any], credentials: Credentials) -> None:
    """Let only certified members connect, and publish only what they are entitled to."""
    config["transport"]["link"] |= {"protocols": sorted(ENCRYPTED), "tls": credentials.tls()}
    is_client = config["mode"] == "client"
    config["access_control"] = credentials.access_control(is_client=is_client)


def _own_endpoints(network: NetworkSettings) -> tuple[str, ...]:
    """Return a free port of the own address that reaches a seed, or of the interface."""
    if network.role == "client":
        return ()
    host = "127.0.0.1"
    if network.connect:
        host = _own_address_towards_any(network.connect)
    elif network.interface:
        host = address_of_interface(network.interface)
    protocol = "tcp" if network.credentials is None else "tls"
    return (f"{protocol}/{socket_address(host, 0)}",)


def _own_address_towards_any(endpoints: tuple[str, ...]) -> str:
    """Return the own address that reaches the first endpoint to which there is a way.

    Raises NetworkUnavailableError if there is none.
    """
    problems = []
    for endpoint in endpoints:
        try:
            return own_address_towards(parse_endpoint(endpoint))
        except OSError as error:
            problems.append(f"{endpoint}: {format_reason(error)}")
    raise NetworkUnavailableError("; ".join(problems))
