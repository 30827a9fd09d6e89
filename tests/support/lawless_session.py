"""A session of a member of a deployment that obeys no access control itself, as an attacker's would."""

import json
from pathlib import Path
from typing import Any

import zenoh

from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_config import zenoh_config
from crcolony.transport.zenoh_session import Session


def open_lawless_session(endpoint: str, credentials: Path) -> Session:
    """Connect with somebody's certificate, and say whatever is to be said."""
    config = zenoh_config(NetworkSettings(connect=(endpoint,), credentials=credentials))
    del config["access_control"]
    return open_config(config)


def open_session_without_certificate(endpoint: str, credentials: Path) -> Session:
    """Connect over TLS with nothing but the certificate of the authority, which is no secret."""
    config = zenoh_config(NetworkSettings(connect=(endpoint,), credentials=credentials))
    del config["access_control"]
    tls = config["transport"]["link"]["tls"]
    config["transport"]["link"]["tls"] = {
        "root_ca_certificate": tls["root_ca_certificate"],
        "verify_name_on_connect": False,
    }
    config["listen"]["endpoints"] = []  # without a certificate it cannot listen
    return open_config(config)


def open_config(config: dict[str, Any]) -> Session:
    """Open a session with a configuration of Zenoh."""
    return zenoh.open(zenoh.Config.from_json5(json.dumps(config)))
