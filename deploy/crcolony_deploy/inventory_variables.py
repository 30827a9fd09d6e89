"""The variables of an inventory that are crcolony's: their names, types and defaults."""

from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

Name = Annotated[str, Meta(pattern=r"^[A-Za-z0-9_.-]{1,64}$")]
Count = Annotated[int, Meta(ge=1, le=10_000)]
Port = Annotated[int, Meta(ge=1024, le=65_000)]
Settings = dict[str, Any]
"""Settings of the config by key, as in `life.agents: 10`."""


class _Entry(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    name: Name


class RobotEntry(_Entry, frozen=True, kw_only=True):
    """A robot; it may be written as its name alone."""

    arena: str = ""
    """Arena or bridge that gives it a body; empty: the only one there is"""
    number: Annotated[int, Meta(ge=0, le=9_999)] | None = None
    """Slot, and share of an earlier run; None: its place among the robots of its arena"""


class ArenaEntry(_Entry, frozen=True, kw_only=True):
    """An arena of simulated bodies."""

    robots: Count | None = None
    """Slots; None: its robots, and two more"""
    speed: Annotated[float, Meta(gt=0.0, le=1_000.0)] | None = None
    """Multiple of real time"""


class BridgeEntry(_Entry, frozen=True, kw_only=True):
    """A bridge with attached robots."""

    devices: Annotated[tuple[str, ...], Meta(min_length=1, max_length=64)]
    """Each as DRIVER@ADDRESS"""
    hz: Annotated[float, Meta(ge=1.0, le=100.0)] | None = None


class RouterEntry(_Entry, frozen=True, kw_only=True):
    """A Zenoh router."""

    connect: Annotated[tuple[str, ...], Meta(max_length=64)] = ()
    """Endpoints of routers of other sites, which are in no inventory of this one"""


class DashboardEntry(_Entry, frozen=True, kw_only=True):
    """A dashboard in Rerun."""

    web: bool = True
    port: Port = 9876
    web_port: Port = 9090


class Variables(
    msgspec.Struct,
    frozen=True,
    forbid_unknown_fields=True,
    kw_only=True,
    rename="crcolony_{}".format,
):
    """All variables that begin with crcolony_."""

    address: str = ""
    """IP address at which the other hosts reach this one; empty: ansible_host"""
    colony: Name = "colony"
    topology: Literal["multicast", "seeds", "routers"] = "multicast"
    interface: str = "eth0"
    """Network interface for discovery by multicast"""
    seeds: tuple[str, ...] = ()
    """Hosts to whose first service all others connect"""
    clients_of: tuple[str, ...] = ()
    """Hosts with a router, of which all others are clients"""
    first_port: Port = 7447
    settings: Settings = {}
    """Of the config of robots and arenas"""
    run: str = msgspec.field(default="", name="crcolony_from")
    """Folder, on the computer that deploys, of an earlier run with whose robots they begin"""
    python: str = "/usr/bin/python3"
    wheelhouse: str = "wheelhouse"
    """Folder, on the computer that deploys, with the packages to install"""
    code_cache: str = "~/.cache/crcolony/hosts"
    """Folder, there, in which compiled code is kept for hosts of the same processor; empty: each host compiles"""
    authority: str = ""
    """Folder, there, of the colony's authority, which certifies every service; empty: an open network"""
    authority_at: str = ""
    """HOST:PORT of `crcolony authority serve`, at which hosts renew certificates; empty: `site.yml` renews them"""
    open_network: bool = False
    """Whether it is meant that there is no authority"""
    robots: tuple[RobotEntry, ...] = ()
    arenas: tuple[ArenaEntry, ...] = ()
    bridges: tuple[BridgeEntry, ...] = ()
    routers: tuple[RouterEntry, ...] = ()
    dashboards: tuple[DashboardEntry, ...] = ()


KINDS = {
    "router": RouterEntry,
    "arena": ArenaEntry,
    "bridge": BridgeEntry,
    "robot": RobotEntry,
    "dashboard": DashboardEntry,
}
"""Kinds of services, in the order in which they get their ports and are started."""
