"""Which services run on a host of an inventory, and with which options: what a playbook then writes and starts."""

from dataclasses import dataclass
from typing import Any

from crcolony.transport.endpoint import socket_address
from crcolony_deploy.inventory import Inventory, InventoryHost, settings_of

STATE_FOLDER = "/var/lib/crcolony"
CREDENTIALS_FOLDER = "/etc/crcolony/credentials"
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
    def options_file(self) -> str:
        """The file with its options, which its unit reads."""
        return f"/etc/crcolony/{self.instance}.env"

    @property
    def unit(self) -> str:
        """Its systemd unit."""
        return f"crcolony-{self.kind}@{self.name}.service"


@dataclass(frozen=True)
class HostPlan:
    """All services of a host, and what they need."""

    services: tuple[Service, ...]
    network: str
    """Options of a command that watches the colony from this host"""
    extras: tuple[str, ...]
    """Of the package crcolony"""


def plan_host(inventory: Inventory, host: InventoryHost) -> HostPlan:
    """Return what runs on a host."""
    services = []
    for index, (kind, entry) in enumerate(host.services()):
        port = _port_of(host, kind, index)
        words = [
            *_own_words(inventory, host, kind, entry),
            *_network_words(inventory, host, port, kind),
        ]
        services.append(Service(kind, entry.name, " ".join(words), port))
    kinds = {service.kind for service in services}
    extras = [
        extra for kind, extra in (("bridge", "bridge"), ("dashboard", "viz")) if kind in kinds
    ]
    watching = " ".join(_network_words(inventory, host, 0, "observer"))
    return HostPlan(tuple(services), watching, tuple(extras))


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


def _network_words(inventory: Inventory, host: InventoryHost, port: int, kind: str) -> list[str]:
    """Return the options with which a service, or an observer, reaches all others."""
    variables = host.variables
    protocol = "tls" if variables.credentials else "tcp"
    listen = f"{protocol}/{socket_address(host.address, port)}" if port else ""
    words: list[str] = []
    if variables.topology == "multicast":
        words += ["--interface", variables.interface]
    elif variables.topology == "routers" and kind != "router":
        words += ["--client"]
    for name in variables.seeds if variables.topology == "seeds" else variables.clients_of:
        other = inventory.host(name)
        endpoint = f"{protocol}/{socket_address(other.address, other.variables.first_port)}"
        if endpoint != listen:
            words += ["--connect", endpoint]
    if listen:
        words += ["--listen", listen]
    if variables.credentials:
        words += ["--credentials", CREDENTIALS_FOLDER]
    return words
