"""Services that share a folder of credentials are examined once, and so is whoever watches."""

from pathlib import Path

from crcolony_deploy.doctor.credential_folder import read_credential_folders

from crcolony.transport.network_settings import NetworkSettings
from tests.support.deployment import Deployment
from tests.support.examined_hosts import service


def test_a_folder_is_read_once_for_all_its_services(tmp_path: Path) -> None:
    """Beside it that of the one who watches; services without credentials have none."""
    deployment = Deployment(tmp_path)
    _, ada = deployment.robot("ada")
    wall = deployment.member("observer", "wall")
    services = [
        service("robot", "ada", f"--credentials {ada} --client --connect tls/10.0.0.1:7447"),
        service("robot", "bob", f"--credentials {ada} --listen tls/10.0.0.2:7447"),
        service("robot", "open"),
    ]
    first, second = read_credential_folders(services, NetworkSettings(credentials=wall))
    assert [one.name for one in first.services] == ["ada", "bob"]
    assert [network.role for network in first.networks] == ["client", "peer"]
    assert first.credentials is not None
    assert (second.folder, second.services, second.problem) == (wall, (), "")
    assert second.may_watch
    assert not first.may_watch


def test_what_cannot_be_read_says_why(tmp_path: Path) -> None:
    """Instead of credentials."""
    (found,) = read_credential_folders([], NetworkSettings(credentials=tmp_path / "none"))
    assert found.credentials is None
    assert "missing" in found.problem
