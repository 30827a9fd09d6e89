"""The folders of credentials that a host's services use, each with the services that share it."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from crcolony.protocol.roster import Role
from crcolony.transport.credentials import Credentials, load_credentials
from crcolony.transport.interface import NetworkError
from crcolony.transport.network_settings import NetworkSettings
from crcolony_deploy.doctor.installed_services import InstalledService

WATCHING: tuple[Role, ...] = ("observer", "operator", "router")
"""Roles to which states of robots are sent."""


@dataclass(frozen=True)
class CredentialFolder:
    """A folder of credentials, as it was read."""

    folder: Path
    services: tuple[InstalledService, ...]
    """None: it is a person's, who watches"""
    networks: tuple[NetworkSettings, ...]
    """How it is used"""
    credentials: Credentials | None = None
    """None if they cannot be used: `problem` says why"""
    problem: str = ""

    @property
    def may_watch(self) -> bool:
        """Whether states of robots are sent to this member."""
        return self.credentials is not None and self.credentials.record.role in WATCHING


def read_credential_folders(
    services: Iterable[InstalledService], watching: NetworkSettings
) -> tuple[CredentialFolder, ...]:
    """Return the folders of some services and of the one who watches, each once."""
    users: dict[Path, list[InstalledService]] = {}
    networks: dict[Path, list[NetworkSettings]] = {}
    for service in services:
        if service.credentials is not None:
            users.setdefault(service.credentials, []).append(service)
            networks.setdefault(service.credentials, []).append(service.network)
    if watching.credentials is not None and watching.credentials not in networks:
        networks[watching.credentials] = [watching]
    return tuple(
        _read(folder, tuple(users.get(folder, ())), tuple(used))
        for folder, used in networks.items()
    )


def _read(
    folder: Path, services: tuple[InstalledService, ...], networks: tuple[NetworkSettings, ...]
) -> CredentialFolder:
    try:
        return CredentialFolder(folder, services, networks, load_credentials(folder))
    except NetworkError as error:
        return CredentialFolder(folder, services, networks, problem=str(error))
