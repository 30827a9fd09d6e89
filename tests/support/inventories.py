"""Inventories for tests: written as YAML, and read back."""

from pathlib import Path

from crcolony_deploy.inventory import load_inventory

GOOD = """\
colony:
  vars:
    crcolony_colony: reef
    crcolony_topology: seeds
    crcolony_seeds: [field]
    crcolony_open_network: true
  hosts:
    field:
      ansible_host: 10.0.0.1
      crcolony_arenas: [{name: pond, robots: 4}]
    ada:
      ansible_host: 10.0.0.2
      crcolony_robots: [ada, {name: adele}]
    bob:
      ansible_host: 10.0.0.3
      crcolony_robots: [bob]
"""
"""An arena, and three robots on two hosts."""


def write(folder: Path, text: str) -> Path:
    """Write an inventory."""
    path = folder / "inventory.yml"
    path.write_text(text, "utf-8")
    return path


def problems_of(folder: Path, text: str) -> list[str]:
    """Return what is wrong with an inventory."""
    return load_inventory(write(folder, text))[1]
