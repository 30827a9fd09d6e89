"""The services that are installed on this host, by the files with their options in /etc/crcolony."""

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

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
    observer = InstalledService("observer", "", words)
    credentials = observer.value("--credentials")
    return NetworkSettings(
        role="client" if "--client" in words else "peer",
        connect=tuple(observer.values("--connect")),
        interface=observer.value("--interface"),
        credentials=Path(credentials) if credentials else None,
    )


def network_of_services(services: list[InstalledService]) -> NetworkSettings:
    """Return how somebody reaches the colony of these services from their host."""
    for service in services:
        connect = tuple(service.values("--connect"))
        if "--client" in service.words:
            return NetworkSettings(role="client", connect=connect)
        interface = service.value("--interface")
        if connect or interface:
            return NetworkSettings(connect=connect, interface=interface)
    listening = [value for service in services for value in service.values("--listen")]
    return NetworkSettings(connect=tuple(listening[:1]))
