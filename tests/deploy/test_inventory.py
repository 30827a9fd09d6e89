"""An inventory is checked as a whole before any host is touched: each mistake is a line that names it."""

from pathlib import Path

import pytest
from crcolony_deploy.errors import DeployError
from crcolony_deploy.inventory import load_inventory, valid_inventory

from tests.support.inventories import GOOD, problems_of, write


def test_a_good_inventory_has_no_problem(tmp_path: Path) -> None:
    """Robots have the only arena there is."""
    inventory = valid_inventory(write(tmp_path, GOOD))
    assert [host.address for host in inventory.hosts] == ["10.0.0.1", "10.0.0.2", "10.0.0.3"]
    robots = [(host.name, robot.name) for host, robot in inventory.entries("robot")]
    assert robots == [("ada", "ada"), ("ada", "adele"), ("bob", "bob")]
    assert {inventory.arena_of(robot) for _, robot in inventory.entries("robot")} == {"pond"}


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("[field]", "[feild]", "crcolony_seeds: there is no host feild; did you mean field?"),
        ("[bob]", "[ada]", "host bob: robot ada is also on ada"),
        ("name: adele", "name: ada", "host ada: robot ada is also on ada"),
        ("robots: 4", "robots: 2", "arena pond: 3 robots for 2 bodies"),
        ("10.0.0.3", "10.0.0.2", "host bob: has the address of ada: 10.0.0.2"),
        ("ansible_host: 10.0.0.3", "ansible_port: 22", "host bob: no address: ansible_host"),
        ("10.0.0.3", "bob.local", "host bob: bob.local is no IP address; crcolony_address says"),
        ("[bob]", "[{name: bob, arena: pnod}]", "there is no arena pnod; did you mean pond?"),
        ("[bob]", "[{name: bob, arean: pond}]", "bob: arean is not known; did you mean arena?"),
        ("[bob]", "[b/b]", "crcolony_robots[0].name: Expected `str` matching regex"),
        ("[bob]", "bob", "host bob: crcolony_robots: expected a list"),
        ("[bob]", "[{arena: pond}]", "host bob: crcolony_robots: {'arena': 'pond'} has no name"),
        ("crcolony_robots: [bob]", "crcolony_robot: [bob]", "did you mean crcolony_robots?"),
        ("crcolony_colony: reef", "colour: reef", "colour is no variable of crcolony or Ansible"),
        ("reef", "'{{ x }}'", "crcolony_colony: templates cannot be used"),
        ("topology: seeds", "topology: star", "crcolony_topology: Invalid enum value 'star'"),
        ("crcolony_seeds: [field]", "crcolony_seeds: []", "topology seeds needs crcolony_seeds"),
        ("crcolony_topology: seeds", "crcolony_topology: routers", "needs crcolony_clients_of"),
        (
            "crcolony_topology: seeds",
            "crcolony_topology: routers\n    crcolony_clients_of: [field]",
            "crcolony_clients_of: no router runs on field",
        ),
        (
            "crcolony_colony: reef",
            "crcolony_settings: {life.agnets: 3}",
            "crcolony_settings: defaults with --set",
        ),
        ("crcolony_colony: reef", "crcolony_from: runs/none", "runs/none: no such folder"),
        (
            "crcolony_robots: [bob]",
            "crcolony_bridges: [{name: pond, devices: [firmware@/dev/ttyACM0]}]",
            "host bob: bridge pond is also on field",
        ),
        (
            "crcolony_robots: [bob]",
            "crcolony_bridges: [{name: desk, devices: [firmware@/a, firmware@/a]}]",
            "host bob: device firmware@/a is there 2 times",
        ),
        (
            "crcolony_robots: [bob]",
            "crcolony_bridges: [{name: desk, devices: [ttyACM0]}]",
            "host bob: device ttyACM0: expected DRIVER@ADDRESS",
        ),
    ],
)
def test_a_mistake_is_a_line_that_names_it(
    tmp_path: Path, old: str, new: str, problem: str
) -> None:
    """With what was probably meant."""
    assert old in GOOD
    found = problems_of(tmp_path, GOOD.replace(old, new, 1))
    assert any(problem in line for line in found), found
    assert all("\n" not in line for line in found)


def test_arenas_that_could_be_meant_are_not_guessed(tmp_path: Path) -> None:
    """With two arenas every robot says which."""
    two = GOOD.replace("[{name: pond, robots: 4}]", "[{name: pond}, {name: lake}]")
    found = problems_of(tmp_path, two)
    assert found[0] == "host ada: robot ada: its arena is missing: there are several"
    assert len(found) == 3


def test_an_inventory_in_which_nothing_runs_is_a_problem(tmp_path: Path) -> None:
    """Its services were forgotten."""
    (found,) = problems_of(tmp_path, "all: {hosts: {ada: {ansible_host: 10.0.0.1}}}")
    assert found.startswith("nothing is to run")


def test_whoever_needs_a_valid_inventory_is_told_the_first_problem(tmp_path: Path) -> None:
    """And how many there are."""
    path = write(tmp_path, GOOD.replace("[bob]", "[ada]").replace("10.0.0.3", "10.0.0.2"))
    assert len(load_inventory(path)[1]) == 2
    with pytest.raises(DeployError, match=r"host bob: has the address of ada.*\(and 1 more\)"):
        valid_inventory(path)
