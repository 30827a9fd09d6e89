"""A launch starts the right processes with the right options."""

import shlex
from pathlib import Path

import msgspec
import pytest

from crcolony.config import Config
from crcolony.runtime import launch_plan
from crcolony.runtime.launch_plan import (
    LaunchNetworks,
    LaunchOptions,
    child_processes,
    choose_networks,
    chosen_networks,
    connect_option,
    mesh_warning,
)
from crcolony.transport.network_settings import HERE, MAX_MESH_ROBOTS, NetworkSettings

LAUNCH = LaunchOptions(
    config=Config(),
    count=2,
    folder=Path("run"),
    colony="blue",
    arena="lab",
    network=None,
    wall_period_s=0.05,
    robots_only=False,
    minutes=None,
)
SEED, OTHER = "tcp/10.0.0.1:7447", "tcp/10.0.0.2:7447"


def launch(**changes: object) -> LaunchOptions:
    return LaunchOptions(**{**LAUNCH.__dict__, **changes})


def test_few_robots_form_a_mesh_on_the_default_port() -> None:
    """The arena listens there, and the robots connect to it."""
    networks = choose_networks(LAUNCH)
    assert networks == LaunchNetworks(
        NetworkSettings(connect=(HERE,)), NetworkSettings(listen=(HERE,)), None, HERE
    )


def test_many_robots_are_clients_of_a_router() -> None:
    """As is the arena."""
    networks = choose_networks(launch(count=MAX_MESH_ROBOTS + 1))
    assert networks.router == NetworkSettings(role="router", listen=(HERE,))
    assert networks.robots == networks.arena == NetworkSettings(role="client", connect=(HERE,))


def test_where_a_launch_listens_a_router_serves_many_robots() -> None:
    """It listens there in place of the arena, with what else was asked for."""
    network = NetworkSettings(listen=(SEED,), connect=(OTHER,), lease_ms=9000, is_open=True)
    networks = choose_networks(launch(network=network, count=MAX_MESH_ROBOTS + 1))
    assert networks.router == msgspec.structs.replace(network, role="router")
    clients = NetworkSettings(role="client", connect=(SEED,), lease_ms=9000, is_open=True)
    assert networks.robots == networks.arena == clients
    assert networks.endpoint == SEED


@pytest.mark.parametrize(
    ("network", "is_mesh"),
    [
        (NetworkSettings(connect=(SEED,)), True),
        (NetworkSettings(interface="eth0"), True),
        (NetworkSettings(listen=(SEED,)), False),
        (NetworkSettings(connect=(SEED,), role="client"), False),
        (None, False),
    ],
)
def test_a_mesh_of_many_robots_is_warned_of(network: NetworkSettings | None, is_mesh: bool) -> None:
    """It is left as it is asked for, where nobody of the launch could be a router."""
    many = launch(network=network, count=MAX_MESH_ROBOTS + 1)
    assert bool(mesh_warning(many, choose_networks(many))) == is_mesh
    few = launch(network=network, count=MAX_MESH_ROBOTS)
    assert mesh_warning(few, choose_networks(few)) is None


def test_a_second_launch_chooses_another_port() -> None:
    """So that the two colonies are not connected; also if the first one is only about to listen."""
    with chosen_networks(LAUNCH), chosen_networks(LAUNCH) as networks:
        assert networks.endpoint != HERE
        assert networks.robots.connect == networks.arena.listen == (networks.endpoint,)


def test_a_port_that_is_in_use_is_not_chosen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever listens there."""
    monkeypatch.setattr(launch_plan, "is_taken", lambda endpoint: True)
    with chosen_networks(LAUNCH) as networks:
        assert networks.endpoint != HERE


def test_robots_alone_connect_to_the_default_port() -> None:
    """Which the arena of another process uses."""
    with chosen_networks(LAUNCH), chosen_networks(launch(robots_only=True)) as networks:
        assert networks.robots.connect == (HERE,)


@pytest.mark.parametrize(
    ("network", "endpoint"),
    [
        (NetworkSettings(connect=(SEED,)), SEED),
        (NetworkSettings(interface="eth0"), "--interface eth0"),
    ],
)
def test_a_given_network_is_used_by_all(network: NetworkSettings, endpoint: str) -> None:
    """The endpoint is what other processes need to join."""
    assert choose_networks(launch(network=network)) == LaunchNetworks(
        network, network, None, endpoint
    )


def test_where_the_arena_listens_the_robots_connect() -> None:
    """Its first endpoint is where other processes join."""
    network = NetworkSettings(listen=(SEED,))
    networks = choose_networks(launch(network=network))
    assert networks == LaunchNetworks(NetworkSettings(connect=(SEED,)), network, None, SEED)


def commands(options: LaunchOptions, folder: Path) -> dict[str, list[str]]:
    """Return the command lines by process."""
    options = launch(**{**options.__dict__, "folder": folder})
    return {child.name: child.command for child in child_processes(options, NETWORKS)}


NETWORKS = LaunchNetworks(
    NetworkSettings(connect=(SEED,)), NetworkSettings(listen=(SEED,)), None, SEED
)


def test_every_process_gets_its_options(tmp_path: Path) -> None:
    """In real time: names, folders, clock and network."""
    lines = commands(launch(has_dashboard=True), tmp_path)
    assert list(lines) == ["arena", "dashboard", "robot 0", "robot 1"]
    arena, robot = " ".join(lines["arena"]), " ".join(lines["robot 1"])
    config = tmp_path / "config.toml"
    assert (
        arena
        == f"arena --config {config} --arena lab --out {tmp_path}/arena --hz 20.0 --listen {SEED}"
    )
    assert robot == (
        f"robot --config {config} --colony blue --arena lab --out {tmp_path}/robots/1"
        f" --connect {SEED} --number 1"
    )
    assert lines["dashboard"] == ["dashboard", "--web", "--out", str(tmp_path), "--connect", SEED]
    assert (tmp_path / "logs").is_dir()


def test_a_lockstep_launch_is_repeatable(tmp_path: Path) -> None:
    """The arena expects all robots, and these have the randomness of their numbers."""
    lines = commands(launch(wall_period_s=None), tmp_path)
    assert lines["arena"][-5:] == ["--lockstep", "--expect", "2", "--listen", SEED]
    assert lines["robot 0"][-1] == "--repeatable"


def test_robots_alone_request_any_slot(tmp_path: Path) -> None:
    """There is no arena in such a launch."""
    lines = commands(launch(robots_only=True, wall_period_s=None), tmp_path)
    assert list(lines) == ["robot 0", "robot 1"]
    assert not {"--number", "--repeatable"} & set(lines["robot 0"])


def test_a_router_is_the_first_process(tmp_path: Path) -> None:
    """All other processes get the option `--client`."""
    client = NetworkSettings(role="client", connect=(SEED,))
    router = NetworkSettings(role="router", listen=(SEED,))
    networks = LaunchNetworks(client, client, router, SEED)
    children = child_processes(launch(folder=tmp_path), networks)
    assert [child.name for child in children] == ["router", "arena", "robot 0", "robot 1"]
    assert children[0].command == ["router", "--listen", SEED]
    assert "--client" in children[1].command
    assert msgspec.structs.replace(client, role="peer") == NETWORKS.robots


@pytest.mark.parametrize(
    "endpoint",
    ["tcp/[::1]:7447", "tcp/10.0.0.1:7447?rel=1#iface=eth0;bind=x", "unixsock-stream//tmp/a b"],
)
def test_the_hint_survives_a_shell(endpoint: str) -> None:
    """Any endpoint, and an interface; without the default one."""
    assert shlex.split(connect_option(endpoint)) == ["--connect", endpoint]
    assert connect_option("tcp/[::1]:7447") == " --connect 'tcp/[::1]:7447'"
    assert connect_option("tcp/10.0.0.1:7447") == " --connect tcp/10.0.0.1:7447"
    assert connect_option("--interface eth0") == " --interface eth0"
    assert connect_option(HERE) == ""
