"""Reads an inventory in Ansible's own YAML: hosts in groups, with variables. What Ansible would pass over is refused.

Ansible takes the last of two hosts with one name, and any variable whatever its name: here that is a problem.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from crcolony.errors import did_you_mean
from crcolony_deploy.errors import DeployError

_GROUP_KEYS = ("hosts", "vars", "children")
_TOP = "all"


@dataclass(frozen=True)
class HostEntry:
    """A host with the variables that are in force for it: its own, then those of its groups."""

    name: str
    variables: dict[str, Any]


@dataclass
class _Group:
    depth: int
    name: str
    variables: dict[str, Any] = field(default_factory=dict)
    hosts: dict[str, dict[str, Any]] = field(default_factory=dict)


def read_hosts(path: Path, problems: list[str]) -> list[HostEntry]:
    """Return the hosts of an inventory in its order; what is wrong is added to `problems`.

    Raises DeployError for a file that cannot be read, or is no YAML.
    """
    content = _load(path)
    if not isinstance(content, dict) or not content:
        raise DeployError(f"{path}: no inventory: expected groups of hosts, as all: {{hosts: …}}")
    groups: list[_Group] = []
    for name, body in content.items():
        groups.extend(_groups_of(str(name), body, 0 if name == _TOP else 1, problems))
    # The variables of a group that is further in win, as in Ansible; its own win over all.
    groups.sort(key=lambda group: (group.depth, group.name))
    names = dict.fromkeys(host for group in groups for host in group.hosts)
    hosts = []
    for name in names:
        of_groups: dict[str, Any] = {}
        own: dict[str, Any] = {}
        for group in groups:
            if name in group.hosts or group.name == _TOP or _holds(content, group.name, name):
                of_groups |= group.variables
            own |= group.hosts.get(name, {})
        hosts.append(HostEntry(name, of_groups | own))
    return hosts


def _groups_of(name: str, body: Any, depth: int, problems: list[str]) -> Iterator[_Group]:
    """Yield a group and all groups in it."""
    if body is None:
        body = {}
    if not isinstance(body, dict):
        problems.append(f"group {name}: expected hosts, vars or children")
        return
    for key in body:
        if key not in _GROUP_KEYS:
            hint = did_you_mean(str(key), _GROUP_KEYS)
            problems.append(f"group {name}: {key} is not known here{hint}")
    group = _Group(depth, name)
    parts: dict[str, dict[str, Any]] = {}
    for key in _GROUP_KEYS:
        part = body.get(key) or {}
        if not isinstance(part, dict):
            problems.append(f"group {name}: {key}: expected names with a colon after each")
            part = {}
        parts[key] = part
    group.variables = dict(parts["vars"])
    for host, variables in parts["hosts"].items():
        if "[" in str(host):
            problems.append(f"host {host}: ranges of hosts cannot be used; name each host")
        elif variables is not None and not isinstance(variables, dict):
            problems.append(f"host {host}: expected variables")
        else:
            group.hosts[str(host)] = variables or {}
    yield group
    for child, inner in parts["children"].items():
        yield from _groups_of(str(child), inner, depth + 1, problems)


def _holds(groups: Any, wanted: str, host: str, is_inside: bool = False) -> bool:
    """Return whether a host is in a group, or in one of the groups in it."""
    if not isinstance(groups, dict):
        return False
    for name, body in groups.items():
        if not isinstance(body, dict):
            continue
        here = is_inside or name == wanted
        if here and isinstance(body.get("hosts"), dict) and host in body["hosts"]:
            return True
        if _holds(body.get("children"), wanted, host, here):
            return True
    return False


def _load(path: Path) -> Any:
    try:
        import yaml  # type: ignore[import-untyped]
    except ImportError:
        raise DeployError(
            "inventories need PyYAML, not installed here: pip install 'crcolony[deploy]'"
        ) from None

    class Loader(yaml.SafeLoader):  # type: ignore[misc]
        """YAML without the rule that the last of two equal keys wins."""

        def construct_mapping(self, node: Any, deep: bool = False) -> Any:
            seen = set()
            for key_node, _ in node.value:
                key = self.construct_object(key_node, deep=True)
                if str(key) in seen:
                    line = key_node.start_mark.line + 1
                    raise DeployError(f"{path}: line {line}: {key} is there twice")
                seen.add(str(key))
            return super().construct_mapping(node, deep=deep)

    try:
        with path.open(encoding="utf-8") as file:
            return yaml.load(file, Loader)
    except OSError as error:
        raise DeployError(f"{path}: cannot be read: {error.strerror}") from None
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        mark = getattr(error, "problem_mark", None)
        where = f"line {mark.line + 1}: " if mark is not None else ""
        what = getattr(error, "problem", None) or "cannot be understood"
        raise DeployError(f"{path}: {where}no YAML: {what}") from None
