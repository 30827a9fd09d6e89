"""Ansible's own YAML is read as Ansible does; what Ansible would pass over in silence is refused."""

from pathlib import Path

import pytest
from crcolony_deploy.errors import DeployError
from crcolony_deploy.inventory_file import read_hosts

from tests.support.inventories import write

NESTED = """\
all:
  vars: {where: all, only_all: 1}
  children:
    site:
      vars: {where: site}
      children:
        desk:
          vars: {where: desk}
          hosts:
            ada: {own: 1}
      hosts:
        bob: {where: host}
        ada: {}
"""


def test_the_variables_of_the_innermost_group_win_and_those_of_the_host_over_all(
    tmp_path: Path,
) -> None:
    """As in Ansible; a host may be in several groups."""
    problems: list[str] = []
    hosts = {host.name: host.variables for host in read_hosts(write(tmp_path, NESTED), problems)}
    assert problems == []
    assert hosts == {
        "bob": {"where": "host", "only_all": 1},
        "ada": {"where": "desk", "only_all": 1, "own": 1},
    }


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("all: {host: {}}", "group all: host is not known here; did you mean hosts?"),
        (
            "all: {hosts: {'r[1:3]': {}}}",
            "host r[1:3]: ranges of hosts cannot be used; name each host",
        ),
        ("all: {hosts: [a]}", "group all: hosts: expected names with a colon after each"),
        ("all: {hosts: {a: 1}}", "host a: expected variables"),
        ("all: 3", "group all: expected hosts, vars or children"),
    ],
)
def test_what_is_no_inventory_is_a_line(tmp_path: Path, text: str, problem: str) -> None:
    """With the group or host in which it is."""
    problems: list[str] = []
    read_hosts(write(tmp_path, text), problems)
    assert problems == [problem]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("all:\n  hosts:\n    ada: {}\n    ada: {}\n", "line 4: ada is there twice"),
        ("all: [", "line 1: no YAML"),
        ("", "no inventory"),
        ("[]", "no inventory"),
        ("\0", "no YAML"),
        ("a: !!python/object:os.system {}", "no YAML"),
    ],
)
def test_a_file_that_cannot_be_read_is_wrong_input(tmp_path: Path, text: str, reason: str) -> None:
    """A host that is there twice too, of which Ansible takes the last."""
    with pytest.raises(DeployError, match=reason):
        read_hosts(write(tmp_path, text), [])


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    """With the reason."""
    with pytest.raises(DeployError, match=r"none\.yml: cannot be read: No such file"):
        read_hosts(tmp_path / "none.yml", [])
