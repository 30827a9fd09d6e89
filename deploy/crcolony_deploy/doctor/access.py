"""Whether certificates and access control are in force: shown by sessions with the services' own configuration."""

from collections.abc import Iterator

import msgspec

from crcolony.transport.credentials import Credentials
from crcolony.transport.interface import NetworkError
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_config import zenoh_config
from crcolony.transport.zenoh_session import free_port
from crcolony_deploy.doctor.access_proof import Config, ProofError, is_lawless_heard, open_doors
from crcolony_deploy.doctor.finding import Finding, ok, problem
from crcolony_deploy.doctor.host_state import HostState

_REMEDY = "of what was installed something was changed: install this version of crcolony again"


def check_access(host: HostState) -> Iterator[Finding]:
    """Try on loopback what must be refused, once for every folder of credentials and way of using it."""
    for one in host.credential_folders:
        if one.credentials is None or one.credentials.member is None:
            continue  # what is wrong is said of its certificate, or membership
        for role in dict.fromkeys(network.role for network in one.networks):
            name = f"{one.credentials.record.common_name} as {role}"
            try:
                yield from _examine(one.credentials, NetworkSettings(role=role), name)
            except (NetworkError, ProofError) as error:
                yield problem(
                    f"{name}: whether access control is in force cannot be shown: {error}",
                    "is its certificate valid? crcolony doctor --only certificates",
                )


def _examine(credentials: Credentials, network: NetworkSettings, name: str) -> Iterator[Finding]:
    config = loopback_config(credentials, network)
    if is_lawless_heard(config, credentials.record.colony):
        yield problem(
            f"{name}: ACCESS CONTROL IS NOT IN FORCE: a state in another's name is accepted",
            _REMEDY,
        )
    else:
        yield ok(f"{name}: access control is in force: a state in another's name is refused")
    if network.role == "client":  # which listens on nothing
        return
    doors = open_doors(config)
    for door in doors:
        yield problem(f"{name}: CERTIFICATES ARE NOT IN FORCE: {door} is accepted", _REMEDY)
    if not doors:
        yield ok(f"{name}: connections in plain text and without a certificate are refused")


def loopback_config(credentials: Credentials, network: NetworkSettings) -> Config:
    """Return the configuration of a service, but for its endpoints: those are a free port of loopback.

    Raises NetworkError.
    """
    endpoint = f"tls/127.0.0.1:{free_port()}"
    is_client = network.role == "client"
    config = zenoh_config(
        msgspec.structs.replace(
            network,
            connect=(endpoint,) if is_client else (),
            listen=() if is_client else (endpoint,),
            credentials=credentials.folder,
        )
    )
    if credentials.record.role == "router":  # which may send everything: it is taken from it
        _forget(config, credentials.record.common_name)
    return config


def _forget(config: Config, common_name: str) -> None:
    section = config["access_control"]
    section["policies"] = [one for one in section["policies"] if common_name not in one["subjects"]]
    section["subjects"] = [one for one in section["subjects"] if one["id"] != common_name]
