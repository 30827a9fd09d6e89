"""Credentials are read whole, and say how both ends of a link prove who they are."""

from pathlib import Path

import pytest

from crcolony.protocol.identity import Identity
from crcolony.transport.credentials import load_credentials, store_roster
from crcolony.transport.interface import NetworkError
from tests.support.deployment import Deployment


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return Deployment(tmp_path).member("robot", "kitchen", Identity(bytes(32)))


def test_both_ends_show_certificates_that_end_their_links_when_they_expire(folder: Path) -> None:
    """The file of key and certificate is one, so that a renewal replaces both at once."""
    tls = load_credentials(folder).tls()
    assert tls["enable_mtls"] is True
    assert tls["close_link_on_expiration"] is True
    identity = str(folder / "identity.pem")
    assert {
        tls[f"{end}_{part}"]
        for end in ("listen", "connect")
        for part in ("private_key", "certificate")
    } == {identity}


def test_a_key_that_others_may_read_is_refused(folder: Path) -> None:
    """As a robot's own key is."""
    (folder / "identity.pem").chmod(0o640)
    with pytest.raises(NetworkError, match="others may read this key"):
        load_credentials(folder)


def test_a_folder_that_cannot_be_looked_into_is_refused(tmp_path: Path) -> None:
    """With the reason of the system; not every reason is that a file is missing."""
    with pytest.raises(NetworkError, match="File name too long"):
        load_credentials(tmp_path / ("n" * 300))


def test_a_roster_of_another_colony_or_authority_is_refused(folder: Path, tmp_path: Path) -> None:
    """It would give rights to strangers."""
    same_name = Deployment(tmp_path / "same")
    other = Deployment(tmp_path / "other", colony="other")
    (folder / "roster").write_bytes(same_name.authority.signed_roster)
    with pytest.raises(NetworkError, match="not signed by the authority"):
        load_credentials(folder)
    foreign = other.member("robot", "kitchen", Identity(bytes(32)))
    record = (foreign / "member.json").read_text().replace('"other"', '"colony"')
    (foreign / "member.json").write_text(record)
    with pytest.raises(NetworkError, match="of colony other, not colony"):
        load_credentials(foreign)


def test_a_member_without_an_entry_is_said_to_have_none(tmp_path: Path) -> None:
    """Its credentials are of an older roster, or it was removed."""
    deployment = Deployment(tmp_path)
    early = deployment.authority.signed_roster
    folder = deployment.member("observer", "wall")
    (folder / "roster").write_bytes(early)
    assert load_credentials(folder).member is None


def test_a_newer_roster_replaces_the_old_one_where_the_folder_can_be_written(
    folder: Path, tmp_path: Path
) -> None:
    """Elsewhere the process goes on with what it knows."""
    store_roster(folder, b"newer")
    assert (folder / "roster").read_bytes() == b"newer"
    assert sorted(path.name for path in folder.iterdir() if path.name.startswith(".")) == []
    store_roster(tmp_path / "missing", b"newer")
