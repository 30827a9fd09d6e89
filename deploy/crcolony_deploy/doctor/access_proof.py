"""Shows whether a configuration of Zenoh refuses what it must, by sessions on loopback that try it.

A section `access_control` without `enabled: true`, or a listener that demands no certificate, looks the same in a file
and does nothing. So a member that obeys no access control itself says, under its own certificate, what it may say and
what it may not.
"""

import contextlib
import copy
import json
import os
import threading
from collections.abc import Iterator
from typing import Any

import zenoh

from crcolony.errors import CrcolonyError
from crcolony.protocol.identity import ID_BYTES
from crcolony.protocol.key_expressions import ROOT, ColonyKeys, roster_serial_key
from crcolony.transport.close_session import closing
from crcolony.transport.open_files import allow_open_files
from crcolony.transport.zenoh_samples import callback

Config = dict[str, Any]

_TIMEOUT_S = 5.0
_REPEAT_S = 0.05
"""What is said is repeated: a member learns only some moments after it is connected who subscribes."""
_REFUSED_MS = 1000
"""How long an intruder tries to connect; one that is accepted is within milliseconds."""


class ProofError(CrcolonyError):
    """Nothing can be shown; the message says why."""


def is_lawless_heard(config: Config, colony: str) -> bool:
    """Return whether a session with this configuration receives what its own member may not send.

    It listens on loopback, or is a client of what it is to connect to. Raises ProofError if it does not receive either
    what the member may send.
    """
    victim = ColonyKeys(colony).state(os.urandom(ID_BYTES))
    permitted = roster_serial_key(colony)
    heard: set[str] = set()
    is_through = threading.Event()

    def on_sample(sample: zenoh.Sample) -> None:
        heard.add(str(sample.key_expr))
        if str(sample.key_expr) == permitted:
            is_through.set()

    with _both(config) as (lawful, lawless):
        subscriber = lawful.declare_subscriber(f"{ROOT}/**", callback(on_sample))
        for _ in range(round(_TIMEOUT_S / _REPEAT_S)):
            # In this order over one link: when the second is there, the first has been, or was refused.
            lawless.put(victim, b"forged")
            lawless.put(permitted, b"")
            if is_through.wait(_REPEAT_S):
                break
        subscriber.undeclare()  # type: ignore[no-untyped-call]
    if not is_through.is_set():
        raise ProofError("what it may say does not arrive either")
    return victim in heard


def open_doors(config: Config) -> list[str]:
    """Return the ways in which a listener with this configuration is reached without a certificate."""
    with closing(_open(config)):
        return [
            name
            for name, intruder in (
                ("a connection in plain text", _intruder(config, "tcp")),
                ("a connection without a certificate", _intruder(config, "tls")),
            )
            if _is_accepted(intruder)
        ]


@contextlib.contextmanager
def _both(config: Config) -> Iterator[tuple[zenoh.Session, zenoh.Session]]:
    """Have a session with a configuration inside the context, and one with the same certificate that obeys nothing."""
    other = copy.deepcopy(config)
    other.pop("access_control", None)
    listen, connect = config["listen"]["endpoints"], config["connect"]["endpoints"]
    other["listen"]["endpoints"], other["connect"]["endpoints"] = connect, listen
    other["mode"] = "router" if config["mode"] == "client" else "peer"
    first, second = (other, config) if config["mode"] == "client" else (config, other)
    with closing(_open(first)) as one, closing(_open(second)) as two:
        yield (two, one) if config["mode"] == "client" else (one, two)


def _intruder(config: Config, protocol: str) -> Config:
    """Return the configuration of a client that trusts the same authority, and has no certificate."""
    intruder = copy.deepcopy(config)
    intruder.pop("access_control", None)
    endpoints = [
        endpoint.replace("tls/", f"{protocol}/") for endpoint in config["listen"]["endpoints"]
    ]
    intruder["mode"] = "client"
    intruder["listen"]["endpoints"] = []
    intruder["connect"] |= {"endpoints": endpoints, "timeout_ms": {"client": _REFUSED_MS}}
    link = intruder["transport"]["link"]
    link.pop("protocols", None)
    tls = link.pop("tls", {})
    link["tls"] = {
        key: value
        for key, value in tls.items()
        if key in ("root_ca_certificate", "verify_name_on_connect")
    }
    return intruder


def _is_accepted(intruder: Config) -> bool:
    try:
        with closing(zenoh.open(_zenoh(intruder))):
            return True
    except zenoh.ZError:
        return False


def _open(config: Config) -> zenoh.Session:
    allow_open_files()
    zenoh.init_log_from_env_or("off")
    try:
        return zenoh.open(_zenoh(config))
    except zenoh.ZError as error:
        raise ProofError(str(error).splitlines()[0].partition(" at /")[0]) from None


def _zenoh(config: Config) -> zenoh.Config:
    return zenoh.Config.from_json5(json.dumps(config))
