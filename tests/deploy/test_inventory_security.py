"""How hosts prove who they are is checked with the inventory: by an authority, or openly, on purpose."""

from pathlib import Path

import pytest
from crcolony_deploy.authority import Authority, AuthoritySettings
from crcolony_deploy.inventory import valid_inventory
from crcolony_deploy.inventory_security import security_problems
from crcolony_deploy.service_plan import plan_host

from tests.support.inventories import GOOD, write
from tests.support.paths import ROOT

CERTIFIED = GOOD.replace("crcolony_open_network: true", "crcolony_authority: authority")


def problems_of(folder: Path, text: str) -> list[str]:
    return list(security_problems(valid_inventory(write(folder, text))))


def test_an_open_network_needs_two_switches(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One in the inventory, one in the environment of who runs the playbook."""
    monkeypatch.delenv("CRCOLONY_OPEN_NETWORK", raising=False)
    closed = GOOD.replace("    crcolony_open_network: true\n", "")
    assert "anybody on the network may steer" in problems_of(tmp_path, closed)[0]
    assert "needs CRCOLONY_OPEN_NETWORK=yes" in problems_of(tmp_path, GOOD)[0]
    monkeypatch.setenv("CRCOLONY_OPEN_NETWORK", "yes")
    assert problems_of(tmp_path, GOOD) == []
    assert len(problems_of(tmp_path, closed)) == 1


def test_an_authority_is_there_and_of_this_colony(tmp_path: Path) -> None:
    """And it can certify every name."""
    assert "crcolony_authority" in problems_of(tmp_path, CERTIFIED)[0]
    Authority.create(tmp_path / "authority", AuthoritySettings("reef"))
    assert problems_of(tmp_path, CERTIFIED) == []
    other = CERTIFIED.replace("crcolony_colony: reef", "crcolony_colony: sea")
    assert problems_of(tmp_path, other)[0].endswith("the authority is of colony reef, not sea")
    dotted = CERTIFIED.replace("crcolony_robots: [bob]", "crcolony_robots: [b.o.b]")
    assert "host bob: 'b.o.b': a member's name has" in problems_of(tmp_path, dotted)[0]
    address = CERTIFIED.replace(
        "crcolony_authority: authority",
        "crcolony_authority: authority\n    crcolony_authority_at: here",
    )
    assert "crcolony_authority_at: expected HOST:PORT" in problems_of(tmp_path, address)[0]


def test_a_colony_has_one_authority(tmp_path: Path) -> None:
    """A host with another one would be connected to nobody."""
    mixed = CERTIFIED.replace(
        "ansible_host: 10.0.0.3", "ansible_host: 10.0.0.3\n      crcolony_authority: other"
    )
    assert problems_of(tmp_path, mixed) == [
        "crcolony_authority: some hosts have another one: a colony has one authority"
    ]


@pytest.mark.parametrize(
    "path", sorted((ROOT / "deploy/zenoh").glob("*.yml")), ids=lambda p: p.stem
)
def test_every_topology_has_an_inventory_that_is_valid(path: Path, tmp_path: Path) -> None:
    """With an authority; no service of it needs an open network."""
    Authority.create(tmp_path / "authority", AuthoritySettings("reef"))
    inventory = valid_inventory(write(tmp_path, path.read_text("utf-8")))
    assert list(security_problems(inventory)) == []
    for host in inventory.hosts:
        for service in plan_host(inventory, host).services:
            assert "--credentials" in service.options
            assert "tcp/" not in service.options
