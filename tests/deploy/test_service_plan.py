"""From an inventory follow the options of each service: those of its topology, and its own."""

import argparse
from pathlib import Path

import pytest
from crcolony_deploy.inventory import valid_inventory
from crcolony_deploy.service_plan import HostPlan, plan_host

from crcolony.cli import make_parser
from tests.support.inventories import GOOD, write

SEED = "--connect tcp/10.0.0.1:7447"
OPEN = " --open-network"
ROUTERS = """\
all:
  vars: {crcolony_topology: routers, crcolony_clients_of: [west, east]}
  hosts:
    west: {ansible_host: 10.0.0.1, crcolony_routers: [west]}
    east: {ansible_host: 10.0.0.2, crcolony_routers: [east], crcolony_arenas: [pond]}
    ada: {ansible_host: 10.0.0.3, crcolony_robots: [ada]}
"""


def plan(folder: Path, text: str, host: str) -> HostPlan:
    """Return the plan of a host."""
    inventory = valid_inventory(write(folder, text))
    return plan_host(inventory, inventory.host(host))


def options_of(folder: Path, text: str, host: str) -> list[str]:
    """Return the options of the services of a host."""
    return [service.options for service in plan(folder, text, host).services]


def test_services_have_ports_one_after_the_other_and_seeds_to_connect_to(tmp_path: Path) -> None:
    """A seed does not connect to itself; robots are numbered within their arena."""
    assert options_of(tmp_path, GOOD, "field") == ["--robots 4 --listen tcp/10.0.0.1:7447" + OPEN]
    ada, adele = options_of(tmp_path, GOOD, "ada")
    assert ada == (
        f"--colony reef --arena pond --number 0 --generations 0 {SEED} --listen tcp/10.0.0.2:7447{OPEN}"
    )
    assert adele.endswith(f"--number 1 --generations 0 {SEED} --listen tcp/10.0.0.2:7448{OPEN}")
    assert plan(tmp_path, GOOD, "ada").network == SEED + OPEN


def test_with_routers_all_others_are_clients_of_both_and_listen_nowhere(tmp_path: Path) -> None:
    """Routers connect to each other."""
    both = "--connect tcp/10.0.0.1:7447 --connect tcp/10.0.0.2:7447"
    assert options_of(tmp_path, ROUTERS, "west") == [
        "--connect tcp/10.0.0.2:7447 --listen tcp/10.0.0.1:7447" + OPEN
    ]
    router, arena = options_of(tmp_path, ROUTERS, "east")
    assert router == "--connect tcp/10.0.0.1:7447 --listen tcp/10.0.0.2:7447" + OPEN
    assert arena == f"--robots 3 --client {both}{OPEN}"
    assert options_of(tmp_path, ROUTERS, "ada")[0].endswith(f"--client {both}{OPEN}")


def test_multicast_needs_no_address_of_others(tmp_path: Path) -> None:
    """But services listen on their own address alone."""
    text = GOOD.replace("crcolony_topology: seeds", "crcolony_interface: wlan0").replace(
        "    crcolony_seeds: [field]\n", ""
    )
    assert options_of(tmp_path, text, "bob")[0].endswith(
        "--interface wlan0 --listen tcp/10.0.0.3:7447" + OPEN
    )


def test_settings_runs_and_credentials_become_options(tmp_path: Path) -> None:
    """Settings of every type, as --set has them."""
    (tmp_path / "run").mkdir()
    more = (
        "crcolony_colony: reef\n    crcolony_from: run\n    crcolony_authority: authority"
        "\n    crcolony_settings: {life.agents: 8, arena.area_per_robot_m2: 0.2}"
    )
    (bob,) = options_of(tmp_path, GOOD.replace("crcolony_colony: reef", more), "bob")
    assert "--from /var/lib/crcolony/from" in bob
    assert "--set life.agents=8 --set arena.area_per_robot_m2=0.2" in bob
    assert bob.endswith(
        "--connect tls/10.0.0.1:7447 --listen tls/10.0.0.3:7447"
        " --credentials /var/lib/crcolony/credentials/robot-bob"
    )


def test_bridges_and_dashboards_need_extras(tmp_path: Path) -> None:
    """A bridge serves its devices under its own name; a dashboard has ports for viewers."""
    text = GOOD.replace(
        "crcolony_robots: [bob]",
        "crcolony_bridges: [{name: desk, devices: [firmware@/dev/ttyACM0], hz: 10}]"
        "\n      crcolony_dashboards: [wall]",
    ).replace("[ada, {name: adele}]", "[{name: ada, arena: pond}]")
    found = plan(tmp_path, text, "bob")
    assert found.extras == ("bridge", "viz")
    bridge, dashboard = found.services
    assert bridge.options.startswith("--robot firmware@/dev/ttyACM0 --hz 10")
    assert dashboard.options.startswith("--colony reef --port 9876 --web --web-port 9090")
    assert (bridge.unit, bridge.port) == ("crcolony-bridge@desk.service", 7447)
    assert dashboard.options_file == "/etc/crcolony/dashboard-wall.env"


@pytest.mark.parametrize("text", [GOOD, ROUTERS])
def test_the_commands_know_all_options(tmp_path: Path, text: str) -> None:
    """An option that a command has no longer would be found here, not on a host."""
    inventory = valid_inventory(write(tmp_path, text))
    for host in inventory.hosts:
        for service in plan_host(inventory, host).services:
            needed = ["--out", "x"] if service.kind == "robot" else []
            words = [service.kind, *needed, *service.options.split()]
            assert isinstance(make_parser().parse_args(words), argparse.Namespace)


def test_every_service_and_the_host_itself_are_members_with_credentials_of_their_own(
    tmp_path: Path,
) -> None:
    """A robot for its key, an arena for its name; an open network says so in the environment of a service."""
    text = GOOD.replace("crcolony_open_network: true", "crcolony_authority: authority")
    field, ada = plan(tmp_path, text, "field"), plan(tmp_path, text, "ada")
    arena, watcher = field.members
    assert (arena.role, arena.name, arena.arenas) == ("arena", "pond", ("pond",))
    assert (watcher.role, watcher.name) == ("observer", "host-field")
    assert [member.key for member in ada.members] == [
        "/var/lib/crcolony/robot-ada/key",
        "/var/lib/crcolony/robot-adele/key",
        "",
    ]
    assert len({member.folder for member in ada.members}) == 3
    assert ada.network.endswith("--credentials /var/lib/crcolony/credentials/observer-host-ada")
    assert "deploy" in ada.extras
    assert "OPEN" not in ada.services[0].environment
    opened = plan(tmp_path, GOOD, "ada").services[0].environment
    assert opened.splitlines()[1] == "CRCOLONY_OPEN_NETWORK=yes"


def test_routers_of_other_sites_are_connected_to(tmp_path: Path) -> None:
    """By endpoint: they are in another inventory."""
    text = ROUTERS.replace(
        "crcolony_routers: [west]",
        "crcolony_routers: [{name: west, connect: [tcp/192.0.2.1:7447]}]",
    )
    assert options_of(tmp_path, text, "west")[0].endswith("--connect tcp/192.0.2.1:7447")
