"""What a launch starts: which processes, with which command lines, on which network."""

import contextlib
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import msgspec

from crcolony.config import Config
from crcolony.runtime.started_process import StartProcess, start_interpreter
from crcolony.runtime.supervisor import DASHBOARD, ChildProcess
from crcolony.storage.files import make_folder
from crcolony.transport.network_settings import HERE, MAX_MESH_ROBOTS, PORT, NetworkSettings
from crcolony.transport.port_claim import claim_port
from crcolony.transport.zenoh_session import free_port, is_taken


@dataclass(frozen=True)
class LaunchOptions:
    """What to start."""

    config: Config
    count: int
    """Robots, each its own process"""
    folder: Path
    colony: str
    arena: str
    network: NetworkSettings | None
    """None: a port of this machine, for this colony alone"""
    wall_period_s: float | None
    """Time between two ticks of the arena; None: lockstep"""
    robots_only: bool
    minutes: float | None
    has_dashboard: bool = False
    """Whether to show the colony in a browser"""
    has_plots: bool = True
    """Whether to draw figures at the end"""
    shares_memory: bool = True
    """Whether robots share memory with bodies on this machine"""

    @property
    def is_repeatable(self) -> bool:
        """Whether the same seed gives the same history: in lockstep, with an arena of its own."""
        return self.wall_period_s is None and not self.robots_only


@dataclass(frozen=True)
class LaunchNetworks:
    """How the processes of a launch connect to the network."""

    robots: NetworkSettings
    arena: NetworkSettings
    router: NetworkSettings | None
    endpoint: str
    """Where other processes join them, as an option of the command line if it starts with a dash"""


@contextlib.contextmanager
def chosen_networks(launch: LaunchOptions) -> Iterator[LaunchNetworks]:
    """Yield the networks of a launch; inside the context no other launch chooses their port."""
    if launch.network is not None or launch.robots_only:
        yield choose_networks(launch)
        return
    with claim_port(PORT) as is_granted:
        yield choose_networks(launch, is_usual_port_free=is_granted and not is_taken(HERE))


def choose_networks(launch: LaunchOptions, is_usual_port_free: bool = True) -> LaunchNetworks:
    """Return the given network, or one on this machine, with a router for more robots than a mesh carries.

    Who listens introduces the robots to each other; where nobody of this launch listens there is a mesh of any size.
    """
    network = launch.network
    if network is None:
        seed = HERE if is_usual_port_free else f"tcp/127.0.0.1:{free_port()}"
        joins = launch.robots_only
        network = NetworkSettings(connect=(seed,)) if joins else NetworkSettings(listen=(seed,))
    if launch.robots_only or not network.listen:
        endpoint = (*network.connect, f"--interface {network.interface}")[0]
        return LaunchNetworks(network, network, None, endpoint)
    robots = NetworkSettings(
        connect=network.listen, lease_ms=network.lease_ms, is_open=network.is_open
    )
    if launch.count <= MAX_MESH_ROBOTS:
        return LaunchNetworks(robots, network, None, network.listen[0])
    clients = msgspec.structs.replace(robots, role="client")
    router = msgspec.structs.replace(network, role="router")
    return LaunchNetworks(clients, clients, router, network.listen[0])


def mesh_warning(launch: LaunchOptions, networks: LaunchNetworks) -> str | None:
    """Return what to say of a mesh with more robots than it carries, as nobody of this launch can be its router."""
    if networks.robots.role == "client" or launch.count <= MAX_MESH_ROBOTS:
        return None
    return (
        f"{launch.count} robots in a mesh, which carries about {MAX_MESH_ROBOTS}: not all may find each other;"
        " start crcolony router, and add --client --connect with its endpoint"
    )


def connect_option(endpoint: str) -> str:
    """Return the option by which another command joins, as it is typed in a shell; empty for the default endpoint.

    The brackets of an IPv6 address are quoted: a shell would take them for a pattern.
    """
    if endpoint == HERE:
        return ""
    return f" {endpoint}" if endpoint.startswith("--") else f" --connect {shlex.quote(endpoint)}"


def child_processes(
    launch: LaunchOptions, networks: LaunchNetworks, start: StartProcess = start_interpreter
) -> list[ChildProcess]:
    """Return the processes to start, in order; creates the folder of their logs.

    `start` starts all but the dashboard, which has other libraries.
    """
    logs = launch.folder / "logs"
    make_folder(logs)
    children = []
    if networks.router is not None:
        children.append(
            _child("router", ["router", *_network_options(networks.router)], logs, start)
        )
    if not launch.robots_only:
        children.append(_child("arena", _arena_command(launch, networks.arena), logs, start))
    if launch.has_dashboard:
        command = _dashboard_command(launch, networks.robots)
        children.append(_child(DASHBOARD, command, logs, start_interpreter))
    for number in range(launch.count):
        command = _robot_command(launch, networks.robots, number)
        children.append(_child(f"robot {number}", command, logs, start))
    return children


def _child(name: str, command: list[str], logs: Path, start: StartProcess) -> ChildProcess:
    return ChildProcess(name, command, logs / f"{name.replace(' ', '-')}.log", start)


def _network_options(network: NetworkSettings) -> list[str]:
    """Return a network as options of the command line."""
    options = [word for endpoint in network.connect for word in ("--connect", endpoint)]
    options += [word for endpoint in network.listen for word in ("--listen", endpoint)]
    if network.interface:
        options += ["--interface", network.interface]
    if network.lease_ms != NetworkSettings().lease_ms:
        options += ["--lease-ms", str(network.lease_ms)]
    if network.is_open:
        options.append("--open-network")
    return [*options, "--client"] if network.role == "client" else options


def _arena_command(launch: LaunchOptions, network: NetworkSettings) -> list[str]:
    clock = (
        ["--lockstep", "--expect", str(launch.count)]
        if launch.wall_period_s is None
        else ["--hz", repr(1.0 / launch.wall_period_s)]
    )
    config = str(launch.folder / "config.toml")
    out = str(launch.folder / "arena")
    command = ["arena", "--config", config, "--arena", launch.arena, "--out", out]
    return [*command, *clock, *_network_options(network)]


def _robot_command(launch: LaunchOptions, network: NetworkSettings, number: int) -> list[str]:
    command = [
        "robot", "--config", str(launch.folder / "config.toml"), "--colony", launch.colony,
        "--arena", launch.arena, "--out", str(launch.folder / "robots" / str(number)),
        *_network_options(network),
    ]  # fmt: skip
    if not launch.robots_only:
        command += ["--number", str(number)]
    if not launch.shares_memory:
        command.append("--no-shared-memory")
    return [*command, "--repeatable"] if launch.is_repeatable else command


def _dashboard_command(launch: LaunchOptions, network: NetworkSettings) -> list[str]:
    return ["dashboard", "--web", "--out", str(launch.folder), *_network_options(network)]
