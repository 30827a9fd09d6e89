"""Certificates are complete, fit their keys and their authority, and are valid for long enough."""

import datetime
import os
import pwd
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from crcolony_deploy.doctor import certificates
from crcolony_deploy.doctor.certificates import check_certificates
from crcolony_deploy.member_folder import install_grant, request_membership

from tests.support.deployment import Deployment
from tests.support.examined_hosts import host_of, lines, service


@pytest.fixture
def deployment(tmp_path: Path) -> Deployment:
    return Deployment(tmp_path / "deployment")


def found(folder: Path, credentials: Path) -> list[str]:
    """Return what is found of a robot with these credentials."""
    robot = service("robot", "ada", f"--connect tls/10.0.0.1:7447 --credentials {credentials}")
    return lines(check_certificates(host_of(folder, robot)))


def test_a_new_certificate_is_well(tmp_path: Path, deployment: Deployment) -> None:
    """It is said when it began, when it is renewed, and when it ends."""
    _, ada = deployment.robot("ada")
    (line,) = found(tmp_path, ada)
    assert line.startswith("ok: certificate of robot.ada: began 0.2 h ago, ends in 24.0 h")
    assert line.endswith("is to be renewed in 7.9 h")


@pytest.mark.parametrize(
    ("age_h", "expected"),
    [
        (
            10.0,
            "ok: certificate of robot.ada: began 10.2 h ago, ends in 14.0 h, is to be renewed now",
        ),
        (
            20.0,
            "warning: certificate of robot.ada: began 20.2 h ago, ends in 4.0 h: the renewal timer does not run",
        ),
        (25.0, "problem: certificate of robot.ada: expired 1.0 h ago: nobody connects with it"),
        (-3.0, "problem: certificate of robot.ada: not valid before 2.8 h from now: this clock"),
    ],
)
def test_the_age_of_a_certificate_is_judged(
    tmp_path: Path, deployment: Deployment, age_h: float, expected: str
) -> None:
    """Due, so late that nobody renews it, expired, or of a time to come: then the clock is behind."""
    then = datetime.datetime.now(datetime.UTC) - datetime.timedelta(hours=age_h)
    _, ada = deployment.robot("ada")
    authority = deployment.authority
    authority.now = lambda: then
    install_grant(ada, authority.admit(request_membership(ada, deployment.applicants[ada])))
    (line,) = found(tmp_path, ada)
    assert line.startswith(expected)


def swap_key(ada: Path, bob: Path) -> None:
    """Give ada's certificate the key of another."""
    mark = "-----BEGIN CERTIFICATE"
    key = (bob / "identity.pem").read_text().partition(mark)[0]
    _, begin, certificate = (ada / "identity.pem").read_text().partition(mark)
    (ada / "identity.pem").write_text(key + begin + certificate)


def no_key(ada: Path, _: Path) -> None:
    text = (ada / "identity.pem").read_text()
    (ada / "identity.pem").write_text(text[text.index("-----BEGIN CERTIFICATE") :])


def of_another(ada: Path, bob: Path) -> None:
    shutil.copy(bob / "identity.pem", ada)


def of_another_authority(ada: Path, __: Path) -> None:
    _, other = Deployment(ada.parent / "stranger").robot("ada")
    shutil.copy(other / "identity.pem", ada)


def open_to_all(ada: Path, _: Path) -> None:
    (ada / "identity.pem").chmod(0o640)


def incomplete(ada: Path, _: Path) -> None:
    (ada / "authority.pem").unlink()


def garbled(ada: Path, _: Path) -> None:
    (ada / "member.json").write_text("no")


@pytest.mark.parametrize(
    ("damage", "expected"),
    [
        (swap_key, "identity.pem: the key is not that of the certificate"),
        (no_key, "identity.pem: no secret key"),
        (of_another, "identity.pem: is of robot.bob, not of robot.ada"),
        (of_another_authority, "identity.pem: not issued by the authority of this deployment"),
        (open_to_all, "identity.pem: others may read this key; chmod 600 it"),
        (incomplete, "authority.pem: missing"),
        (garbled, "member.json: "),
    ],
)
def test_credentials_that_do_not_belong_together_are_a_problem(
    tmp_path: Path, deployment: Deployment, damage: Callable[[Path, Path], None], expected: str
) -> None:
    """The file is named."""
    (_, ada), (_, bob) = deployment.robot("ada"), deployment.robot("bob")
    damage(ada, bob)
    (line,) = found(tmp_path, ada)
    assert line.startswith("problem: ")
    assert expected in line


def test_a_key_of_another_user_is_a_problem_of_services(
    tmp_path: Path, deployment: Deployment, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Their user could not read it; a person's own may be anybody's."""
    _, ada = deployment.robot("ada")
    me = pwd.getpwuid(os.getuid()).pw_name
    monkeypatch.setattr(certificates, "USER", me)
    assert len(found(tmp_path, ada)) == 1
    monkeypatch.setattr(certificates, "USER", "root" if me != "root" else "daemon")
    problem, _ = found(tmp_path, ada)
    assert "cannot read it" in problem


def test_a_service_without_credentials_is_noticed_beyond_this_machine(tmp_path: Path) -> None:
    """Within it, it is not."""
    outside = service("robot", "ada", "--connect tcp/10.0.0.1:7447")
    inside = service("robot", "bob", "--connect tcp/127.0.0.1:7447")
    (line,) = lines(check_certificates(host_of(tmp_path, outside, inside)))
    assert line.startswith("warning: robot-ada has no credentials")


def test_without_cryptography_the_rest_is_examined(
    tmp_path: Path, deployment: Deployment, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Robots that have their certificates need no more than the core."""
    _, ada = deployment.robot("ada")
    monkeypatch.setattr(certificates, "find_spec", lambda _: None)
    (line,) = found(tmp_path, ada)
    assert line.startswith("warning: ")
    assert "without the package cryptography" in line
