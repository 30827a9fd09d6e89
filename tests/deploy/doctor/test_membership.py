"""Members are in the roster, for what their services do."""

from pathlib import Path

import pytest
from crcolony_deploy.doctor.membership import check_membership

from crcolony.protocol.identity import load_key
from crcolony.storage.files import KEY_FILE
from tests.support.deployment import Deployment
from tests.support.examined_hosts import BOB, host_of, lines, service

SEED = "--connect tls/10.0.0.1:7447"


@pytest.fixture
def deployment(tmp_path: Path) -> Deployment:
    return Deployment(tmp_path / "deployment", "reef")


def test_a_member_is_well(tmp_path: Path, deployment: Deployment) -> None:
    """In the newest roster, for its robot."""
    folder, ada = deployment.robot("ada")
    own = {"ada": load_key(folder / KEY_FILE).id}
    host = host_of(tmp_path, service("robot", "ada", f"{SEED} --credentials {ada}"), own=own)
    assert lines(check_membership(host)) == ["ok: robot.ada is in roster 2 of colony reef"]


def test_a_revoked_member_is_a_problem(tmp_path: Path, deployment: Deployment) -> None:
    """And one of a roster in which it does not stand."""
    _, ada = deployment.robot("ada")
    host = host_of(tmp_path, service("robot", "ada", f"{SEED} --credentials {ada}"))
    deployment.authority.revoke("ada")
    deployment.distribute_roster()
    (line,) = lines(check_membership(host))
    assert line == "problem: robot.ada is revoked since roster 3 or before: nobody hears it"
    deployment.authority._replace_roster(())
    deployment.distribute_roster()
    (line,) = lines(check_membership(host_of(tmp_path, *host.services)))
    assert line == "problem: robot.ada is not in roster 4: nobody hears it"


def test_a_client_needs_a_router_in_the_roster(tmp_path: Path, deployment: Deployment) -> None:
    """It believes nobody else."""
    _, ada = deployment.robot("ada")
    client = service("robot", "ada", f"--client {SEED} --credentials {ada}")
    (line,) = lines(check_membership(host_of(tmp_path, client)))
    assert line == "problem: roster 2 has no router: a client believes nobody else"
    deployment.member("router", "west")
    deployment.distribute_roster()
    (line,) = lines(check_membership(host_of(tmp_path, client)))
    assert line.startswith("ok: ")


def test_endpoints_in_plain_text_are_a_problem(tmp_path: Path, deployment: Deployment) -> None:
    """The service would not start."""
    _, ada = deployment.robot("ada")
    plain = service("robot", "ada", f"--connect tcp/10.0.0.1:7447 --credentials {ada}")
    (line,) = lines(check_membership(host_of(tmp_path, plain)))
    assert line == "problem: tcp/10.0.0.1:7447: with credentials every endpoint is tls/HOST:PORT"


def test_services_do_only_what_their_member_may(tmp_path: Path, deployment: Deployment) -> None:
    """A robot's certificate speaks for no other, carries no arena, routes and watches nothing."""
    _, ada = deployment.robot("ada")
    words = f"{SEED} --credentials {ada}"
    kinds = (("robot", "bob"), ("arena", "pond"), ("router", "west"), ("dashboard", "wall"))
    host = host_of(tmp_path, *(service(*kind, words) for kind in kinds), own={"bob": BOB})
    assert [line.partition(";")[0] for line in lines(check_membership(host))] == [
        "problem: robot.ada does not speak for robot bob (62626262): nobody hears it",
        "problem: robot.ada does not carry arena pond: nobody hears it",
        "problem: router-west has the certificate of robot.ada",
        "problem: dashboard-wall has the certificate of robot.ada",
    ]
    west = deployment.member("router", "west")
    services = (service("router", "west", f"--credentials {west}"),)
    assert lines(check_membership(host_of(tmp_path, *services)))[0].startswith("ok: ")
