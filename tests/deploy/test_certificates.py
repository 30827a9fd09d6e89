"""Certificates name their member, are signed by the authority alone, and hold for a stated time."""

import datetime

import pytest
from crcolony_deploy.certificates import (
    CertificateError,
    authority_certificate,
    common_name_of,
    is_issued_by,
    new_key,
    public_half,
    public_key_of,
    request_certificate,
    sign_request,
    validity_of,
)

from crcolony.protocol.identity import Identity

NOW = datetime.datetime(2026, 11, 28, 12, tzinfo=datetime.UTC)
DAY = datetime.timedelta(days=1)
SEED, OTHER_SEED = bytes(32), bytes([1]) * 32
AUTHORITY = authority_certificate(SEED, "lab", NOW)


def certificate(key: bytes, name: str = "robot.kitchen", seed: bytes = SEED) -> bytes:
    return sign_request(request_certificate(key, name), name, seed, AUTHORITY, DAY, NOW)


def test_a_certificate_has_the_name_the_key_and_the_life_it_was_asked_for() -> None:
    """It is to be renewed when a third of its life is over, and tolerates clocks that are 10 minutes behind."""
    key = new_key()
    made = certificate(key)
    assert common_name_of(made) == "robot.kitchen"
    assert public_key_of(made) == public_half(key)
    validity = validity_of(made)
    assert validity.ends_unix_s == (NOW + DAY).timestamp()
    assert validity.begins_unix_s == NOW.timestamp() - 600.0
    assert 7.5 * 3600 < validity.renewal_unix_s - NOW.timestamp() < 8.0 * 3600


def test_an_authority_has_the_key_that_signs_its_rosters() -> None:
    """So that who verifies the one verifies the other."""
    assert public_key_of(AUTHORITY) == Identity(SEED).public_key


def test_a_certificate_of_another_authority_is_told_apart() -> None:
    """Although it names the same issuer."""
    key = new_key()
    assert is_issued_by(certificate(key), AUTHORITY)
    assert not is_issued_by(certificate(key, seed=OTHER_SEED), AUTHORITY)


@pytest.mark.parametrize(
    ("request_pem", "reason"),
    [
        (b"noise", "not a signing request"),
        (AUTHORITY, "not a signing request"),
        (request_certificate(new_key(), "robot.other"), "for another name"),
        (
            request_certificate(new_key(), "robot.kitchen").replace(b"A", b"B", 3),
            "not a signing request|not signed",
        ),
    ],
    ids=["noise", "a certificate", "another name", "damaged"],
)
def test_a_request_that_does_not_fit_is_refused(request_pem: bytes, reason: str) -> None:
    """By its name, and if its own signature is wrong."""
    with pytest.raises(CertificateError, match=reason):
        sign_request(request_pem, "robot.kitchen", SEED, AUTHORITY, DAY, NOW)


@pytest.mark.parametrize("read", [validity_of, common_name_of, public_key_of])
def test_what_is_no_certificate_is_named_so(read: object) -> None:
    """Not with a traceback of the library."""
    with pytest.raises(CertificateError, match="not a certificate"):
        read(b"noise")  # type: ignore[operator]
