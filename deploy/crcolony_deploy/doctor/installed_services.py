"""The services that are installed on this host, by the files with their options in /etc/crcolony."""

import re
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import msgspec

from crcolony.transport.endpoint import parse_endpoint
from crcolony.transport.interface import NetworkError
from crcolony.transport.network_settings import NetworkSettings
from crcolony_deploy.errors import DeployError

_FILE = re.compile(r"(robot|arena|bridge|router|dashboard)-([A-Za-z0-9_.-]+)\.env")


@dataclass(frozen=True)
class InstalledService:
    """A service of this host, with the words of its options."""

    kind: str
    name: str
    words: tuple[str, ...]

    @property
    def instance(self) -> str:
        """Its name with its kind: robot-ada."""
        return f"{self.kind}-{self.name}"

    @property
    def unit(self) -> str:
        """Its systemd unit."""
        return f"crcolony-{self.kind}@{self.name}.service"

    def values(self, option: str) -> list[str]:
        """Return every value of an option, in order."""
        return [
            value for word, value in zip(self.words, self.words[1:], strict=False) if word == option
        ]

    def value(self, option: str, default: str = "") -> str:
        """Return the last value of an option."""
        return (self.values(option) or [default])[-1]

    @property
    def ports(self) -> list[int]:
        """The TCP ports on which it listens."""
        ports = []
        for endpoint in self.values("--listen"):
            try:
                ports.append(parse_endpoint(endpoint, to_listen=True).port)
            except NetworkError:
                continue
        return ports

    @property
    def credentials(self) -> Path | None:
        """The folder with its certificate; None if it proves nothing."""
        folder = self.value("--credentials")
        return Path(folder) if folder else None

    @property
    def network(self) -> NetworkSettings:
        """How it connects."""
        return NetworkSettings(
            role=self._role,
            connect=tuple(self.values("--connect")),
            listen=tuple(self.values("--listen")),
            interface=self.value("--interface"),
            credentials=self.credentials,
        )

    @property
    def _role(self) -> Literal["peer", "client", "router"]:
        if self.kind == "router":
            return "router"
        return "client" if "--client" in self.words else "peer"


def read_services(folder: Path) -> list[InstalledService]:
    """Return the services whose options are in a folder; raises DeployError for a file that cannot be read."""
    services = []
    for path in sorted(folder.glob("*.env")):
        match = _FILE.fullmatch(path.name)
        if match is None:
            continue
        try:
            lines = path.read_text("utf-8").splitlines()
            options = [line.partition("=")[2] for line in lines if line.startswith("OPTIONS=")]
            words = shlex.split(" ".join(options))
        except OSError as error:
            raise DeployError(f"{path}: cannot be read: {error.strerror}") from None
        except ValueError as error:
            raise DeployError(f"{path}: {error}") from None
        services.append(InstalledService(match[1], match[2], tuple(words)))
    return services


def observer_network(folder: Path) -> NetworkSettings | None:
    """Return how this host watches its colony, as a playbook has written it; None if none has."""
    try:
        text = (folder / "observer").read_text("utf-8")
        words = tuple(shlex.split(text.partition("=")[2]))
    except (OSError, ValueError):
        return None
    return InstalledService("observer", "", words).network


def network_of_services(services: list[InstalledService]) -> NetworkSettings:
    """Return how somebody reaches the colony of these services from their host, with the credentials of one of them."""
    for service in services:
        network = service.network
        if network.role == "client":
            return network
        if network.connect or network.interface:
            return msgspec.structs.replace(network, role="peer", listen=())
    for service in services:
        for endpoint in service.values("--listen"):
            return NetworkSettings(connect=(endpoint,), credentials=service.credentials)
    return NetworkSettings()
