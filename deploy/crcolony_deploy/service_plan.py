"""Which services run on a host of an inventory, and with which options: what a playbook then writes and starts."""

from dataclasses import dataclass
from typing import Any

from crcolony.transport.endpoint import socket_address
from crcolony_deploy.inventory import Inventory, InventoryHost, settings_of

STATE_FOLDER = "/var/lib/crcolony"
OPEN_NETWORK = "CRCOLONY_OPEN_NETWORK"
"""The second switch of an open network, in the environment, as for every command of crcolony."""
CREDENTIALS_FOLDER = f"{STATE_FOLDER}/credentials"
"""Of all members on a host, a folder each; certificates are renewed and rosters stored there."""
ROLES = {
    "robot": "robot", "arena": "arena", "bridge": "bridge", "router": "router",
    "dashboard": "observer",
}  # fmt: skip
"""What a service is in a deployment, by its kind."""
RUN_FOLDER = f"{STATE_FOLDER}/from"
"""Where a host keeps the earlier run with whose robots its own begin."""


@dataclass(frozen=True)
class Service:
    """One service of a host."""

    kind: str
    name: str
    options: str
    """Of its command, but for those that its unit has"""
    port: int
    """On which it listens; 0: on none"""

    @property
    def instance(self) -> str:
        """Its name with its kind, as files have it: robot-ada."""
        return f"{self.kind}-{self.name}"

    @property
    def environment(self) -> str:
        """What stands in that file."""
        switch = f"{OPEN_NETWORK}=yes\n" if "--open-network" in self.options else ""
        return f"OPTIONS={self.options}\n{switch}"

    @property
    def options_file(self) -> str:
        """The file with its options, which its unit reads."""
        return f"/etc/crcolony/{self.instance}.env"

    @property
    def unit(self) -> str:
        """Its systemd unit."""
        return f"crcolony-{self.kind}@{self.name}.service"


@dataclass(frozen=True)
class CertifiedMember:
    """A member of the deployment on this host, whose certificate the playbook gets from the authority."""

    role: str
    name: str
    key: str = ""
    """The robot's key for which it speaks"""
    arenas: tuple[str, ...] = ()

    @property
    def folder(self) -> str:
        """Its credentials."""
        return credentials_of(self.role, self.name)


@dataclass(frozen=True)
class HostPlan:
    """All services of a host, and what they need."""

    services: tuple[Service, ...]
    network: str
    """Options of a command that watches the colony from this host"""
    extras: tuple[str, ...]
    """Of the package crcolony"""
    members: tuple[CertifiedMember, ...] = ()
    """All that need certificates: its services, and an observer"""


def plan_host(inventory: Inventory, host: InventoryHost) -> HostPlan:
    """Return what runs on a host."""
    services = []
    for index, (kind, entry) in enumerate(host.services()):
        port = _port_of(host, kind, index)
        words = [
            *_own_words(inventory, host, kind, entry),
            *_network_words(inventory, host, port, kind, entry.name),
        ]
        if kind == "router":
            words += [word for endpoint in entry.connect for word in ("--connect", endpoint)]
        services.append(Service(kind, entry.name, " ".join(words), port))
    kinds = {service.kind for service in services}
    extras = [
        extra for kind, extra in (("bridge", "bridge"), ("dashboard", "viz")) if kind in kinds
    ]
    members: tuple[CertifiedMember, ...] = ()
    if host.variables.authority:
        extras.append("deploy")
        members = (*map(_member_of, services), CertifiedMember("observer", host_member(host)))
    watching = " ".join(_network_words(inventory, host, 0, "observer", host_member(host)))
    return HostPlan(tuple(services), watching, tuple(extras), members)


def host_member(host: InventoryHost) -> str:
    """Return the name under which a host observes its colony."""
    return f"host-{host.name.replace('.', '-')}"


def credentials_of(role: str, name: str) -> str:
    """Return the folder of a member's credentials on its host."""
    return f"{CREDENTIALS_FOLDER}/{role}-{name}"


def _member_of(service: Service) -> CertifiedMember:
    key = f"{STATE_FOLDER}/{service.instance}/key" if service.kind == "robot" else ""
    arenas = (service.name,) if service.kind in ("arena", "bridge") else ()
    return CertifiedMember(ROLES[service.kind], service.name, key, arenas)


def _port_of(host: InventoryHost, kind: str, index: int) -> int:
    """Return the port of the service at this place on its host: clients of routers have none."""
    if host.variables.topology == "routers" and kind != "router":
        return 0
    return host.variables.first_port + index


def _own_words(inventory: Inventory, host: InventoryHost, kind: str, entry: Any) -> list[str]:
    """Return the options of a service that are not about the network."""
    variables = host.variables
    words: list[str] = []
    if kind == "robot":
        arena = inventory.arena_of(entry)
        number = _number_of(inventory, entry) if entry.number is None else entry.number
        words = ["--colony", variables.colony, "--arena", arena, "--number", str(number)]
        words += ["--generations", "0"]
        if variables.run:
            words += ["--from", RUN_FOLDER]
    elif kind == "arena":
        robots = sum(
            inventory.arena_of(robot) == entry.name for _, robot in inventory.entries("robot")
        )
        words = ["--robots", str(entry.robots or robots + 2)]
        if entry.speed is not None:
            words += ["--speed", f"{entry.speed:g}"]
    elif kind == "bridge":
        words = [word for device in entry.devices for word in ("--robot", device)]
        if entry.hz is not None:
            words += ["--hz", f"{entry.hz:g}"]
    elif kind == "dashboard":
        words = ["--colony", variables.colony, "--port", str(entry.port)]
        words += ["--web", "--web-port", str(entry.web_port)] if entry.web else []
    if kind in ("robot", "arena"):
        words += [
            word for setting in settings_of(variables.settings) for word in ("--set", setting)
        ]
    return words


def _number_of(inventory: Inventory, robot: Any) -> int:
    """Return the place of a robot among those of its arena."""
    arena = inventory.arena_of(robot)
    robots = [
        entry for _, entry in inventory.entries("robot") if inventory.arena_of(entry) == arena
    ]
    return robots.index(robot)


def _network_words(
    inventory: Inventory, host: InventoryHost, port: int, kind: str, name: str
) -> list[str]:
    """Return the options with which a service, or an observer, reaches all others."""
    variables = host.variables
    protocol = "tls" if variables.authority else "tcp"
    listen = f"{protocol}/{socket_address(host.address, port)}" if port else ""
    words: list[str] = []
    if variables.topology == "multicast":
        words += ["--interface", variables.interface]
    elif variables.topology == "routers" and kind != "router":
        words += ["--client"]
    for seed in variables.seeds if variables.topology == "seeds" else variables.clients_of:
        other = inventory.host(seed)
        endpoint = f"{protocol}/{socket_address(other.address, other.variables.first_port)}"
        if endpoint != listen:
            words += ["--connect", endpoint]
    if listen:
        words += ["--listen", listen]
    if variables.authority:
        return [*words, "--credentials", credentials_of(ROLES.get(kind, kind), name)]
    return [*words, "--open-network"]
