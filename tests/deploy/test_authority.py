"""An authority admits a member under one name with its own robots, for a limited time, and revokes it for all."""

import datetime
from pathlib import Path

import pytest
from crcolony_deploy.audit_log import read_lines
from crcolony_deploy.audit_record import decode_record
from crcolony_deploy.authority import (
    Authority,
    AuthorityError,
    AuthoritySettings,
    check_member_name,
)
from crcolony_deploy.certificates import common_name_of, validity_of
from crcolony_deploy.member_folder import Applicant, request_membership

from crcolony.errors import CrcolonyError
from crcolony.protocol.identity import Identity
from crcolony.protocol.roster import Roster, open_roster, sign_roster

KITCHEN, HALL = (Identity(bytes([number]) * 32) for number in range(2))


@pytest.fixture
def authority(tmp_path: Path) -> Authority:
    return Authority.create(tmp_path / "authority", AuthoritySettings("lab", lifetime_h=2.0))


def admit(authority: Authority, tmp_path: Path, name: str, robot: Identity) -> bytes:
    applicant = Applicant("robot", name, (robot,))
    grant = authority.admit(request_membership(tmp_path / name, applicant))
    return grant.certificate.encode()


def test_an_admitted_member_is_in_the_roster_and_has_a_certificate(
    authority: Authority, tmp_path: Path
) -> None:
    """Both survive: another process finds the same."""
    now = datetime.datetime.now(datetime.UTC).timestamp()
    certificate = admit(authority, tmp_path, "kitchen", KITCHEN)
    assert common_name_of(certificate) == "robot.kitchen"
    assert abs(validity_of(certificate).ends_unix_s - now - 7200.0) < 60.0
    assert authority.roster.serial == 2
    with Authority.opened(authority.folder) as again:
        assert again.roster == authority.roster
        assert again.find("kitchen").robots == (KITCHEN.id,)
        roster = open_roster(again.signed_roster, again.identity.public_key)
        assert roster == authority.roster


def test_a_renewal_changes_no_roster(authority: Authority, tmp_path: Path) -> None:
    """Nobody else has to open another session for it."""
    admit(authority, tmp_path, "kitchen", KITCHEN)
    admit(authority, tmp_path, "kitchen", KITCHEN)
    assert authority.roster.serial == 2


def test_a_name_and_a_robot_belong_to_one_member(authority: Authority, tmp_path: Path) -> None:
    """Neither can be taken by another, nor changed under way."""
    admit(authority, tmp_path, "kitchen", KITCHEN)
    with pytest.raises(AuthorityError, match=r"robot\.kitchen is taken"):
        admit(authority, tmp_path, "kitchen", HALL)
    with pytest.raises(AuthorityError, match=r"belongs to robot\.kitchen"):
        admit(authority, tmp_path, "thief", KITCHEN)
    assert len(authority.roster.members) == 1


def test_a_revoked_member_is_not_admitted_again_until_it_is_reinstated(
    authority: Authority, tmp_path: Path
) -> None:
    """Its robots are in the roster for others to avoid."""
    admit(authority, tmp_path, "kitchen", KITCHEN)
    assert authority.revoke("kitchen").is_revoked
    assert authority.roster.revoked_robots == {KITCHEN.id}
    assert authority.roster.serial == 3
    authority.revoke("robot.kitchen")
    assert authority.roster.serial == 3  # it changed nothing
    with pytest.raises(AuthorityError, match="is revoked"):
        admit(authority, tmp_path, "kitchen", KITCHEN)
    authority.reinstate("kitchen")
    admit(authority, tmp_path, "kitchen", KITCHEN)
    assert not authority.roster.revoked_robots


def test_an_old_copy_of_an_authority_goes_on_from_the_roster_of_its_colony(
    authority: Authority,
) -> None:
    """Otherwise its next roster would have a number that nobody believes."""
    newer = sign_roster(Roster("lab", 9, ()), authority.identity)
    assert authority.adopt(newer)
    assert not authority.adopt(newer)
    assert not authority.adopt(sign_roster(Roster("other", 99, ()), authority.identity))
    assert authority.roster.serial == 9


def test_an_authority_is_never_overwritten(authority: Authority) -> None:
    """And its key is for its owner alone."""
    with pytest.raises(AuthorityError, match="not empty"):
        Authority.create(authority.folder, AuthoritySettings("lab"))
    assert (authority.folder.stat().st_mode & 0o777) == 0o700
    assert ((authority.folder / "authority.key").stat().st_mode & 0o777) == 0o600


@pytest.mark.parametrize("damage", ["authority.key", "authority.json", "roster", "authority.pem"])
def test_a_damaged_authority_is_named(authority: Authority, damage: str) -> None:
    """With the file, missing or full of noise."""
    (authority.folder / damage).write_bytes(b"noise")
    if damage != "authority.pem":
        with pytest.raises(CrcolonyError):
            Authority.load(authority.folder)
    (authority.folder / damage).unlink()
    with pytest.raises(CrcolonyError, match=damage):
        Authority.load(authority.folder)


@pytest.mark.parametrize("hours", [0.0, -1.0, 1e9])
def test_a_lifetime_is_within_limits(tmp_path: Path, hours: float) -> None:
    """A certificate that holds for years would make a revocation meaningless."""
    with pytest.raises(AuthorityError, match="valid for at most"):
        Authority.create(tmp_path / "a", AuthoritySettings("lab", hours))


@pytest.mark.parametrize("name", ["", "a/b", "a.b", "x" * 49, "é"])
def test_a_name_that_is_none_is_refused(name: str) -> None:
    """It is a part of a common name."""
    with pytest.raises(AuthorityError, match="a member's name has"):
        check_member_name(name)


def test_a_member_that_does_not_exist_is_named_with_those_that_do(
    authority: Authority, tmp_path: Path
) -> None:
    """A person sees at once what was meant."""
    admit(authority, tmp_path, "kitchen", KITCHEN)
    with pytest.raises(AuthorityError, match=r"no such member; there is robot\.kitchen"):
        authority.revoke("kitchne")


def test_what_was_done_is_in_an_audit_log_that_its_key_signs(
    authority: Authority, tmp_path: Path
) -> None:
    """Also renewals, and nothing that changed nothing; who has only the file cannot change it unnoticed."""
    for _ in range(2):
        admit(authority, tmp_path, "kitchen", KITCHEN)
    authority.revoke("kitchen")
    authority.revoke("kitchen")
    authority.reinstate("kitchen")
    lines = [line for _, _, line in read_lines(authority.folder / "audit.jsonl")]
    records = [record for line in lines if (record := decode_record(line)) is not None]
    assert len(records) == len(lines)
    actions = ["create", "admit", "renew", "revoke", "reinstate"]
    assert [record.action for record in records] == actions
    assert {record.key for record in records} == {authority.identity.public_key.hex()}
    assert all(record.is_signed for record in records)
    assert records[3].details == {"member": "robot.kitchen", "roster": "3"}
