"""The doctor shows that certificates and access control are in force, and notices it when they are not."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from crcolony_deploy.doctor import access
from crcolony_deploy.doctor.access import check_access

from crcolony.protocol.roster import Role
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_config import zenoh_config
from tests.support.deployment import Deployment
from tests.support.examined_hosts import host_of, lines, service

SEED = "--connect tls/10.0.0.1:7447"
IN_FORCE = "access control is in force: a state in another's name is refused"
REFUSED = "connections in plain text and without a certificate are refused"


def examine(folder: Path, credentials: Path, options: str = "", kind: str = "robot") -> list[str]:
    """Return what is found of a service with these credentials."""
    words = f"{SEED} --credentials {credentials} {options}"
    return lines(check_access(host_of(folder, service(kind, "ada", words))))


@pytest.fixture
def deployment(tmp_path: Path) -> Deployment:
    return Deployment(tmp_path / "deployment")


def admit(deployment: Deployment, role: Role) -> Path:
    """Admit a member named ada; return its credentials."""
    if role == "robot":
        return deployment.robot("ada")[1]
    return deployment.member(role, "ada", arenas=("pond",) if role == "arena" else ())


@pytest.mark.parametrize("role", ["robot", "arena", "operator"])
def test_what_is_generated_is_in_force(tmp_path: Path, deployment: Deployment, role: Role) -> None:
    """For a member that has rights of its own, and for one that has none."""
    credentials = admit(deployment, role)
    name = f"ok: {role}.ada as peer"
    assert examine(tmp_path, credentials) == [f"{name}: {IN_FORCE}", f"{name}: {REFUSED}"]


def test_a_router_is_shown_to_obey_without_its_own_rights(
    tmp_path: Path, deployment: Deployment
) -> None:
    """It may send everything, so nothing could be refused otherwise."""
    west = deployment.member("router", "west")
    name = "ok: router.west as router"
    found = examine(tmp_path, west, kind="router")
    assert found == [f"{name}: {IN_FORCE}", f"{name}: {REFUSED}"]


def test_a_client_is_shown_to_believe_routers_alone(tmp_path: Path, deployment: Deployment) -> None:
    """It listens on nothing, so nobody can connect to it."""
    credentials = admit(deployment, "robot")
    found = examine(tmp_path, credentials, "--client")
    assert found == [f"ok: robot.ada as client: {IN_FORCE}"]


def not_enabled(config: dict[str, Any]) -> None:
    del config["access_control"]["enabled"]


def allowed_by_default(config: dict[str, Any]) -> None:
    config["access_control"]["default_permission"] = "allow"


def without_section(config: dict[str, Any]) -> None:
    del config["access_control"]


def without_client_certificates(config: dict[str, Any]) -> None:
    config["transport"]["link"]["tls"]["enable_mtls"] = False


def in_plain_text(config: dict[str, Any]) -> None:
    del config["transport"]["link"]["protocols"]
    for end in ("listen", "connect"):
        config[end]["endpoints"] = [one.replace("tls/", "tcp/") for one in config[end]["endpoints"]]


NOT_CONTROLLED = "robot.ada as {}: ACCESS CONTROL IS NOT IN FORCE"
NOT_CERTIFIED = "robot.ada as {}: CERTIFICATES ARE NOT IN FORCE: a connection {} is accepted"


@pytest.mark.parametrize(
    ("options", "sabotage", "expected"),
    [
        ("", not_enabled, NOT_CONTROLLED.format("peer")),
        ("", allowed_by_default, NOT_CONTROLLED.format("peer")),
        ("", without_section, NOT_CONTROLLED.format("peer")),
        ("--client", not_enabled, NOT_CONTROLLED.format("client")),
        ("", without_client_certificates, NOT_CERTIFIED.format("peer", "without a certificate")),
        ("", in_plain_text, NOT_CERTIFIED.format("peer", "in plain text")),
    ],
)
def test_what_is_not_in_force_is_a_problem(
    tmp_path: Path,
    deployment: Deployment,
    monkeypatch: pytest.MonkeyPatch,
    options: str,
    sabotage: Callable[[dict[str, Any]], None],
    expected: str,
) -> None:
    """A section that parses and does nothing, or is away; a listener that demands no certificate."""

    def sabotaged(network: NetworkSettings) -> dict[str, Any]:
        config = zenoh_config(network)
        sabotage(config)
        return config

    monkeypatch.setattr(access, "zenoh_config", sabotaged)
    found = examine(tmp_path, admit(deployment, "robot"), options)
    assert any(line.startswith(f"problem: {expected}") for line in found), found


def test_what_cannot_be_shown_is_a_problem(
    tmp_path: Path, deployment: Deployment, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without any connection nothing forbidden arrives either: that is no proof."""

    def unreachable(network: NetworkSettings) -> dict[str, Any]:
        config = zenoh_config(network)
        for policy in config["access_control"]["policies"]:
            policy["rules"] = ["everyone"]  # of what is sent, nothing of what is received
        return config

    monkeypatch.setattr(access, "zenoh_config", unreachable)
    (line,) = examine(tmp_path, admit(deployment, "robot"))
    assert "cannot be shown: what it may say does not arrive either" in line
