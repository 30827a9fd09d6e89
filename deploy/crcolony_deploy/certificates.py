"""X.509 certificates of a deployment: of its authority, and short-lived ones of its members. Keys are Ed25519.

A member makes its own secret key and asks for a certificate with a signing request (PKCS #10); the key never travels.
"""

import datetime
from dataclasses import dataclass

from cryptography import x509
from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric.ed25519 import (
    Ed25519PrivateKey,
    Ed25519PublicKey,
)
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from crcolony.errors import CrcolonyError

_AUTHORITY_DAYS = 3650
_CLOCK_TOLERANCE = datetime.timedelta(minutes=10)
"""A member's clock may be this much behind that of the authority."""


class CertificateError(CrcolonyError):
    """A certificate or a request cannot be used; the message says why."""


@dataclass(frozen=True)
class Validity:
    """From when until when a certificate is valid, in seconds since 1970."""

    begins_unix_s: float
    ends_unix_s: float

    @property
    def renewal_unix_s(self) -> float:
        """When it is to be renewed: after a third of its life, so that an authority may be away for the rest."""
        return self.begins_unix_s + (self.ends_unix_s - self.begins_unix_s) / 3.0


def new_key() -> bytes:
    """Return a new secret key as PEM."""
    return Ed25519PrivateKey.generate().private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )


def public_half(key_pem: bytes) -> bytes:
    """Return the public key, 32 bytes, of a secret one; raises CertificateError if it is none of Ed25519."""
    return _load_key(key_pem).public_key().public_bytes_raw()


def authority_certificate(seed: bytes, colony: str, now: datetime.datetime) -> bytes:
    """Return the certificate of an authority, signed by itself, as PEM. `seed` is its Ed25519 key, 32 bytes."""
    key = Ed25519PrivateKey.from_private_bytes(seed)
    name = _name(f"authority of {colony}")
    builder = _certificate(name, name, key.public_key(), now, datetime.timedelta(_AUTHORITY_DAYS))
    usage = _key_usage(signs_certificates=True)
    return _pem(
        builder.add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(usage, critical=True)
        .sign(key, None)
    )


def request_certificate(key_pem: bytes, common_name: str) -> bytes:
    """Return a signing request for a member's key, as PEM."""
    key = _load_key(key_pem)
    builder = x509.CertificateSigningRequestBuilder().subject_name(_name(common_name))
    return builder.sign(key, None).public_bytes(serialization.Encoding.PEM)


def sign_request(
    request_pem: bytes,
    common_name: str,
    seed: bytes,
    authority_pem: bytes,
    lifetime: datetime.timedelta,
    now: datetime.datetime,
) -> bytes:
    """Return a member's certificate as PEM.

    Raises CertificateError unless the request is for this common name, and signed by the key that is in it.
    """
    key = Ed25519PrivateKey.from_private_bytes(seed)
    public_key = _public_key_of(request_pem, common_name)
    issuer = x509.load_pem_x509_certificate(authority_pem).subject
    builder = _certificate(_name(common_name), issuer, public_key, now, lifetime)
    both_ends = [ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH]
    return _pem(
        builder.add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(_key_usage(signs_certificates=False), critical=True)
        .add_extension(x509.ExtendedKeyUsage(both_ends), critical=False)
        .add_extension(x509.SubjectAlternativeName([x509.DNSName(common_name)]), critical=False)
        .sign(key, None)
    )


def validity_of(certificate_pem: bytes) -> Validity:
    """Return when a certificate is valid; raises CertificateError if it is none."""
    certificate = _load(certificate_pem)
    return Validity(
        certificate.not_valid_before_utc.timestamp(), certificate.not_valid_after_utc.timestamp()
    )


def common_name_of(certificate_pem: bytes) -> str:
    """Return the common name in a certificate; raises CertificateError if it is none."""
    return _common_name(_load(certificate_pem).subject)


def is_issued_by(certificate_pem: bytes, authority_pem: bytes) -> bool:
    """Return whether an authority signed a certificate; raises CertificateError if either is none."""
    try:
        _load(certificate_pem).verify_directly_issued_by(_load(authority_pem))
    except (ValueError, TypeError, InvalidSignature):
        return False
    return True


def public_key_of(certificate_pem: bytes) -> bytes:
    """Return the Ed25519 public key in a certificate, 32 bytes; raises CertificateError."""
    key = _load(certificate_pem).public_key()
    if not isinstance(key, Ed25519PublicKey):
        raise CertificateError("its key is not Ed25519")
    return key.public_bytes_raw()


def _load_key(pem: bytes) -> Ed25519PrivateKey:
    try:
        key = serialization.load_pem_private_key(pem, None)
    except (ValueError, TypeError, UnsupportedAlgorithm):
        raise CertificateError("no secret key") from None
    if not isinstance(key, Ed25519PrivateKey):
        raise CertificateError("its secret key is not Ed25519")
    return key


def _load(pem: bytes) -> x509.Certificate:
    try:
        return x509.load_pem_x509_certificate(pem)
    except ValueError:
        raise CertificateError("not a certificate") from None


def _public_key_of(request_pem: bytes, common_name: str) -> Ed25519PublicKey:
    try:
        request = x509.load_pem_x509_csr(request_pem)
        is_valid = request.is_signature_valid
        key = request.public_key()
    except (ValueError, TypeError):
        raise CertificateError("not a signing request") from None
    if not is_valid or not isinstance(key, Ed25519PublicKey):
        raise CertificateError("the request is not signed by an Ed25519 key of its own")
    if _common_name(request.subject) != common_name:
        raise CertificateError(f"the request is for another name than {common_name}")
    return key


def _common_name(name: x509.Name) -> str:
    attributes = name.get_attributes_for_oid(NameOID.COMMON_NAME)
    return str(attributes[0].value) if len(attributes) == 1 else ""


def _name(common_name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, common_name[:64])])


def _certificate(
    subject: x509.Name,
    issuer: x509.Name,
    public_key: Ed25519PublicKey,
    now: datetime.datetime,
    lifetime: datetime.timedelta,
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(public_key)
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - _CLOCK_TOLERANCE)
        .not_valid_after(now + lifetime)
    )


def _key_usage(*, signs_certificates: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=True,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        key_cert_sign=signs_certificates,
        crl_sign=False,
        encipher_only=False,
        decipher_only=False,
    )


def _pem(certificate: x509.Certificate) -> bytes:
    return certificate.public_bytes(serialization.Encoding.PEM)
