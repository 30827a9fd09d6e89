"""All that the checks of a host look at: its services, its folders, and what it receives of its colony."""

import subprocess
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from crcolony.protocol.identity import IdentityError, load_key
from crcolony.storage.files import KEY_FILE
from crcolony.telemetry.robot_status import RobotStatus
from crcolony.transport.network_settings import NetworkSettings
from crcolony_deploy.doctor.colony_view import ColonyView, view_colony
from crcolony_deploy.doctor.credential_folder import CredentialFolder, read_credential_folders
from crcolony_deploy.doctor.installed_services import InstalledService

USER = "crcolony"
"""The user of all services."""


@dataclass(frozen=True)
class HostState:
    """One host. What takes time is looked at when a check first asks for it."""

    services: tuple[InstalledService, ...]
    network: NetworkSettings
    seconds: float = 3.0
    """How long the colony is observed, at most"""
    state_folder: Path = Path("/var/lib/crcolony")
    cache_folder: Path = Path("/var/cache/crcolony")
    current: Path = Path("/opt/crcolony/current")
    """The version that runs"""
    proc: Path = Path("/proc")

    def of_kind(self, *kinds: str) -> list[InstalledService]:
        """Return the services of some kinds."""
        return [service for service in self.services if service.kind in kinds]

    @cached_property
    def own_robots(self) -> dict[str, bytes]:
        """The id of every robot of this host whose key can be read, by its name."""
        ids = {}
        for service in self.of_kind("robot"):
            try:
                ids[service.name] = load_key(self.state_folder / service.instance / KEY_FILE).id
            except IdentityError:
                continue
        return ids

    @cached_property
    def credential_folders(self) -> tuple[CredentialFolder, ...]:
        """The credentials of this host's services, and those with which the colony is watched."""
        return read_credential_folders(self.services, self.network)

    @property
    def may_watch(self) -> bool:
        """Whether states of robots reach this host: a robot's certificate, say, entitles to see who is online alone."""
        folder = self.network.credentials
        return folder is None or any(
            one.may_watch for one in self.credential_folders if one.folder == folder
        )

    @cached_property
    def colony(self) -> ColonyView:
        """What this host receives of its colony."""
        wanted = set(self.own_robots.values())

        def is_enough(robots: list[RobotStatus]) -> bool:
            embodied = {s.robot for s in robots if s.state is not None and s.state.arena}
            return bool(wanted) and wanted <= embodied

        return view_colony(self.network, self.seconds, is_enough)


def output_of(*words: str) -> str | None:
    """Return what a command of this host prints; None if there is no such command, or it fails to answer."""
    try:
        done = subprocess.run(words, capture_output=True, text=True, timeout=10, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout
