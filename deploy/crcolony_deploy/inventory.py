"""What runs on which host of a deployment, read from an inventory and checked before anything is touched."""

import ipaddress
import json
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from crcolony.config import ConfigError, load
from crcolony.errors import did_you_mean
from crcolony_deploy.errors import DeployError
from crcolony_deploy.inventory_file import HostEntry, read_hosts
from crcolony_deploy.inventory_variables import KINDS, Variables

_PREFIX = "crcolony_"
_ANSIBLE = "ansible_"
_KNOWN = {field.encode_name: field.name for field in msgspec.structs.fields(Variables)}


@dataclass(frozen=True)
class InventoryHost:
    """A host with its address and variables."""

    name: str
    address: str
    variables: Variables

    def services(self) -> Iterator[tuple[str, Any]]:
        """Yield kind and entry of every service, in the order of their ports."""
        for kind in KINDS:
            for entry in getattr(self.variables, f"{kind}s"):
                yield kind, entry


@dataclass(frozen=True)
class Inventory:
    """All hosts of a deployment."""

    path: Path
    hosts: tuple[InventoryHost, ...]

    def host(self, name: str) -> InventoryHost:
        """Return a host."""
        return next(host for host in self.hosts if host.name == name)

    def entries(self, kind: str) -> Iterator[tuple[InventoryHost, Any]]:
        """Yield every service of a kind, with its host."""
        for host in self.hosts:
            for found, entry in host.services():
                if found == kind:
                    yield host, entry

    def arena_of(self, robot: Any) -> str:
        """Return the arena or bridge of a robot: the one that it names, or the only one."""
        arenas = [entry.name for kind in ("arena", "bridge") for _, entry in self.entries(kind)]
        return robot.arena or (arenas[0] if len(arenas) == 1 else "")

    def local_path(self, text: str) -> Path:
        """Return a path on this computer, which is relative to the inventory."""
        return (self.path.parent / Path(text).expanduser()).resolve()


def load_inventory(path: Path) -> tuple[Inventory, list[str]]:
    """Return an inventory with its problems, a line for each; with any it must not be used.

    Raises DeployError for a file that is no inventory at all.
    """
    problems: list[str] = []
    hosts = []
    for entry in read_hosts(path, problems):
        variables = _variables_of(entry, problems)
        if variables is not None:
            address = variables.address or str(entry.variables.get("ansible_host", ""))
            hosts.append(InventoryHost(entry.name, address, variables))
    inventory = Inventory(path, tuple(hosts))
    if not problems:
        problems.extend(_problems_of(inventory))
    return inventory, problems


def valid_inventory(path: Path) -> Inventory:
    """Return an inventory without problems; raises DeployError with the first, and how many there are."""
    inventory, problems = load_inventory(path)
    if problems:
        more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
        raise DeployError(f"{path}: {problems[0]}{more}")
    return inventory


def _variables_of(entry: HostEntry, problems: list[str]) -> Variables | None:
    """Return crcolony's variables of a host, or None after adding what is wrong with them."""
    where, before = f"host {entry.name}", len(problems)
    own: dict[str, Any] = {}
    for key, value in entry.variables.items():
        if str(key) in _KNOWN:
            own[str(key)] = value
            problems += [f"{where}: {line}" for line in _template_problems(str(key), value)]
        elif not str(key).startswith(_ANSIBLE):
            hint = did_you_mean(str(key), [*_KNOWN, "ansible_host", "ansible_user"])
            problems.append(f"{where}: {key} is no variable of crcolony or Ansible{hint}")
    for kind, entry_type in KINDS.items():
        name = f"{_PREFIX}{kind}s"
        if name in own:
            own[name] = list(_entries(own[name], entry_type, f"{where}: {name}", problems))
    if len(problems) > before:
        return None
    try:
        return msgspec.convert(own, Variables)
    except msgspec.ValidationError as error:
        problems.append(f"{where}: {_plain(str(error))}")
    return None


def _entries(value: Any, entry_type: Any, where: str, problems: list[str]) -> Iterator[Any]:
    """Yield the services of a list, each with a name; a text is a service with this name."""
    if not isinstance(value, list):
        problems.append(f"{where}: expected a list, a line with - for each")
        return
    known = [field.name for field in msgspec.structs.fields(entry_type)]
    for one in value:
        body = {"name": one} if isinstance(one, str) else one
        if not isinstance(body, dict) or "name" not in body:
            problems.append(f"{where}: {one!r} has no name")
            continue
        for key in body:
            if key not in known:
                hint = did_you_mean(str(key), known)
                problems.append(f"{where}: {body['name']}: {key} is not known{hint}")
        yield body


def _template_problems(key: str, value: Any) -> Iterator[str]:
    if "{{" in str(value):
        yield f"{key}: templates cannot be used in variables of crcolony"


def _plain(message: str) -> str:
    """Return an error of msgspec as people say it: the variable first."""
    text, _, at = message.partition(" - at `$.")
    return f"{at.removesuffix('`')}: {text}" if at else message


def _problems_of(inventory: Inventory) -> Iterator[str]:
    """Yield what is wrong between the hosts of an inventory."""
    yield from _address_problems(inventory)
    yield from _name_problems(inventory)
    yield from _arena_problems(inventory)
    yield from _topology_problems(inventory)
    yield from _device_problems(inventory)
    yield from _local_problems(inventory)
    if not any(list(host.services()) for host in inventory.hosts):
        yield "nothing is to run: no host has robots, arenas, bridges, routers or dashboards"


def _address_problems(inventory: Inventory) -> Iterator[str]:
    owners: dict[str, str] = {}
    for host in inventory.hosts:
        if not host.address:
            yield f"host {host.name}: no address: ansible_host or crcolony_address is missing"
            continue
        try:
            ipaddress.ip_address(host.address)
        except ValueError:
            yield (
                f"host {host.name}: {host.address} is no IP address;"
                " crcolony_address says at which one the other hosts reach it"
            )
        if host.address in owners:
            yield f"host {host.name}: has the address of {owners[host.address]}: {host.address}"
        owners.setdefault(host.address, host.name)


def _name_problems(inventory: Inventory) -> Iterator[str]:
    for kinds in (("robot",), ("arena", "bridge"), ("router",), ("dashboard",)):
        owners: dict[str, str] = {}
        for kind in kinds:
            for host, entry in inventory.entries(kind):
                if entry.name in owners:
                    yield f"host {host.name}: {kind} {entry.name} is also on {owners[entry.name]}"
                owners.setdefault(entry.name, host.name)


def _arena_problems(inventory: Inventory) -> Iterator[str]:
    slots = {entry.name: entry.robots for _, entry in inventory.entries("arena")}
    slots |= {entry.name: len(entry.devices) for _, entry in inventory.entries("bridge")}
    taken = Counter[str]()
    for host, robot in inventory.entries("robot"):
        arena = inventory.arena_of(robot)
        if not arena:
            reason = "there are several" if slots else "there is none"
            yield f"host {host.name}: robot {robot.name}: its arena is missing: {reason}"
        elif arena not in slots:
            hint = did_you_mean(arena, slots)
            yield f"host {host.name}: robot {robot.name}: there is no arena {arena}{hint}"
        taken[arena] += 1
    for name, most in slots.items():
        if most is not None and taken[name] > most:
            yield f"arena {name}: {taken[name]} robots for {most} bodies"


def _topology_problems(inventory: Inventory) -> Iterator[str]:
    names = [host.name for host in inventory.hosts]
    for host in inventory.hosts:
        variables = host.variables
        needed = {"seeds": variables.seeds, "routers": variables.clients_of}
        listed = needed.get(variables.topology)
        variable = "crcolony_seeds" if variables.topology == "seeds" else "crcolony_clients_of"
        if listed is None:
            if not variables.interface:
                yield f"host {host.name}: multicast needs crcolony_interface"
            continue
        if not listed:
            yield f"host {host.name}: topology {variables.topology} needs {variable}"
        for name in listed:
            if name not in names:
                hint = did_you_mean(name, names)
                yield f"host {host.name}: {variable}: there is no host {name}{hint}"
            elif variables.topology == "routers" and not inventory.host(name).variables.routers:
                yield f"host {host.name}: {variable}: no router runs on {name}"
            elif not list(inventory.host(name).services()):
                yield f"host {host.name}: {variable}: nothing runs on {name}"


def _device_problems(inventory: Inventory) -> Iterator[str]:
    for host in inventory.hosts:
        devices = Counter(device for bridge in host.variables.bridges for device in bridge.devices)
        for device, count in devices.items():
            if "@" not in device or " " in device:
                yield f"host {host.name}: device {device}: expected DRIVER@ADDRESS"
            if count > 1:
                yield f"host {host.name}: device {device} is there {count} times"


def _local_problems(inventory: Inventory) -> Iterator[str]:
    """Yield what is wrong with files of this computer, and with settings; each once."""
    lines: dict[str, None] = {}
    for host in inventory.hosts:
        variables = host.variables
        if variables.run and not inventory.local_path(variables.run).is_dir():
            lines[f"crcolony_from: {inventory.local_path(variables.run)}: no such folder"] = None
        for key, value in variables.settings.items():
            if any(character in f"{key}{value}" for character in "\n\r\"'\\"):
                lines[f"crcolony_settings: {key}: quotes and several lines cannot be passed on"] = (
                    None
                )
        try:
            load(None, settings_of(variables.settings))
        except ConfigError as error:
            lines[f"crcolony_settings: {error}"] = None
    yield from lines


def settings_of(settings: dict[str, Any]) -> list[str]:
    """Return settings as `--set` has them."""
    return [f"{key}={_as_toml(value)}" for key, value in settings.items()]


def _as_toml(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value, separators=(",", ":"))
