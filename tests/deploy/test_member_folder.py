"""Credentials are written as a whole or not at all, with a secret key that others cannot read."""

import json
from pathlib import Path

import msgspec
import pytest
from crcolony_deploy.authority import Authority, AuthoritySettings
from crcolony_deploy.certificates import public_half, public_key_of
from crcolony_deploy.member_folder import (
    Applicant,
    install_grant,
    read_enrollment,
    request_membership,
    validity_in,
    write_enrollment,
)
from crcolony_deploy.membership_request import Grant, RequestError

from crcolony.protocol.identity import Identity, create_key
from crcolony.transport.credentials import load_credentials
from crcolony.transport.interface import NetworkError

ROBOT = Identity(bytes(32))
KITCHEN = Applicant("robot", "kitchen", (ROBOT,))


@pytest.fixture
def authority(tmp_path: Path) -> Authority:
    return Authority.create(tmp_path / "authority", AuthoritySettings("lab"))


def granted(authority: Authority, folder: Path) -> Grant:
    return authority.admit(request_membership(folder, KITCHEN))


def test_credentials_are_what_a_process_loads(authority: Authority, tmp_path: Path) -> None:
    """Key and certificate belong together, and the roster says for whom the member speaks."""
    folder = tmp_path / "credentials"
    install_grant(folder, granted(authority, folder))
    credentials = load_credentials(folder)
    assert credentials.member is not None
    assert credentials.member.robots == (ROBOT.id,)
    identity = (folder / "identity.pem").read_bytes()
    assert public_half(identity) == public_key_of(identity)
    assert ((folder / "identity.pem").stat().st_mode & 0o777) == 0o600
    assert not (folder / "next_key.pem").exists()
    assert validity_in(folder).ends_unix_s > validity_in(folder).renewal_unix_s


def test_a_renewal_brings_another_key(authority: Authority, tmp_path: Path) -> None:
    """Until it is granted the former credentials stay as they are."""
    folder = tmp_path / "credentials"
    install_grant(folder, granted(authority, folder))
    before = (folder / "identity.pem").read_bytes()
    grant = granted(authority, folder)
    assert (folder / "identity.pem").read_bytes() == before
    install_grant(folder, grant)
    assert public_half((folder / "identity.pem").read_bytes()) != public_half(before)


def test_what_does_not_belong_together_is_not_installed(
    authority: Authority, tmp_path: Path
) -> None:
    """A grant for another request, of two authorities, or for another name; the folder is left as it was."""
    other = Authority.create(tmp_path / "other", AuthoritySettings("lab"))
    folder, elsewhere = tmp_path / "credentials", tmp_path / "elsewhere"
    install_grant(folder, granted(authority, folder))
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    genuine, foreign = granted(authority, elsewhere), granted(other, elsewhere)
    for grant, reason in (
        (genuine, "request first"),
        (msgspec.structs.replace(genuine, authority=foreign.authority), "several"),
        (msgspec.structs.replace(genuine, certificate=foreign.certificate), "several"),
        (msgspec.structs.replace(genuine, roster=foreign.roster), "not signed"),
        (msgspec.structs.replace(genuine, certificate="noise"), "not a certificate"),
    ):
        with pytest.raises(RequestError, match=reason):
            install_grant(folder, grant)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_a_renewal_knows_for_whom_the_member_speaks(authority: Authority, tmp_path: Path) -> None:
    """Nothing has to be typed again."""
    folder, key = tmp_path / "credentials", tmp_path / "key"
    robot = create_key(key)
    applicant = Applicant("robot", "hall", (robot,))
    install_grant(folder, authority.admit(request_membership(folder, applicant)))
    write_enrollment(folder, "10.0.0.5:7448", [key], [])
    again, address = read_enrollment(folder)
    assert (again.common_name, again.robots[0].id) == ("robot.hall", robot.id)
    assert address == "10.0.0.5:7448"
    (folder / "enrollment.json").write_text(json.dumps({"at": 1}))
    with pytest.raises(RequestError):
        read_enrollment(folder)


@pytest.mark.parametrize("missing", ["identity.pem", "authority.pem", "roster", "member.json"])
def test_incomplete_credentials_are_named(
    authority: Authority, tmp_path: Path, missing: str
) -> None:
    """With the file that is missing or damaged."""
    folder = tmp_path / "credentials"
    install_grant(folder, granted(authority, folder))
    if missing in ("roster", "member.json"):
        (folder / missing).write_bytes(b"noise")
        with pytest.raises(NetworkError, match=missing):
            load_credentials(folder)
    (folder / missing).unlink()
    with pytest.raises(NetworkError, match=f"{missing}: missing"):
        load_credentials(folder)
