"""A member's side of enrollment and renewal: it knows its authority by the fingerprint in an invitation, or by file."""

import http.client
import ssl
from pathlib import Path

import msgspec

from crcolony.errors import CrcolonyError
from crcolony.transport.credentials import AUTHORITY_FILE, IDENTITY_FILE
from crcolony_deploy.certificates import CertificateError, public_key_of
from crcolony_deploy.enrollment_service import SERVICE_NAME, EnrollmentRequest
from crcolony_deploy.invitations import fingerprint_of, split_invitation
from crcolony_deploy.member_folder import Applicant, install_grant, request_membership
from crcolony_deploy.membership_request import Grant, MembershipRequest, decode_grant

_TIMEOUT_S = 10.0
_MAX_REPLY_BYTES = 2_097_152


class EnrollmentError(CrcolonyError):
    """The authority cannot be reached, is another one, or refuses; the message says which."""


def enroll(host: str, port: int, invitation: str, applicant: Applicant, folder: Path) -> Grant:
    """Enroll with an invitation, and write the credentials into a folder.

    Raises EnrollmentError, InvitationError, RequestError.
    """
    pin, fingerprint = split_invitation(invitation)
    authority = _fetch_authority(host, port)
    try:
        found = fingerprint_of(public_key_of(authority))
    except CertificateError:
        found = ""
    if found != fingerprint:
        raise EnrollmentError(f"{host}:{port}: not the authority that has written this invitation")
    request = request_membership(folder, applicant)
    body = msgspec.json.encode(EnrollmentRequest(pin, msgspec.Raw(msgspec.json.encode(request))))
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    return _post(host, port, "/enroll", body, authority, context, folder)


def renew(host: str, port: int, request: MembershipRequest, folder: Path) -> Grant:
    """Renew the certificate in a folder of credentials; raises EnrollmentError."""
    try:
        authority = (folder / AUTHORITY_FILE).read_bytes()
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        context.load_cert_chain(folder / IDENTITY_FILE)
    except OSError as error:
        raise EnrollmentError(f"{folder}: {error.strerror}") from None
    body = msgspec.json.encode(request)
    return _post(host, port, "/renew", body, authority, context, folder)


def _fetch_authority(host: str, port: int) -> bytes:
    """Return the certificate that is shown at an address; whether it is the right one is not known yet."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    connection = http.client.HTTPSConnection(host, port, timeout=_TIMEOUT_S, context=context)
    return _exchange(connection, host, port, "GET", "/authority", b"")


def _post(
    host: str,
    port: int,
    path: str,
    body: bytes,
    authority: bytes,
    context: ssl.SSLContext,
    folder: Path,
) -> Grant:
    context.check_hostname = False  # its name is in the certificate, whatever its address is
    context.verify_mode = ssl.CERT_REQUIRED
    context.minimum_version = ssl.TLSVersion.TLSv1_3
    context.load_verify_locations(cadata=authority.decode())
    connection = http.client.HTTPSConnection(host, port, timeout=_TIMEOUT_S, context=context)
    grant = decode_grant(_exchange(connection, host, port, "POST", path, body))
    install_grant(folder, grant)
    return grant


def _exchange(
    connection: http.client.HTTPSConnection,
    host: str,
    port: int,
    method: str,
    path: str,
    body: bytes,
) -> bytes:
    """Return the reply; raises EnrollmentError. Where the peer is verified, it must be the service itself."""
    try:
        connection.connect()
        shown = connection.sock.getpeercert()
        if shown and (("commonName", SERVICE_NAME),) not in shown["subject"]:
            raise EnrollmentError(f"{host}:{port}: a member of the colony, not its authority")
        connection.request(method, path, body)
        response = connection.getresponse()
        data = response.read(_MAX_REPLY_BYTES)
    except (OSError, http.client.HTTPException) as error:
        reason = getattr(error, "reason", None) or getattr(error, "strerror", None) or str(error)
        raise EnrollmentError(f"{host}:{port}: {reason}") from None
    finally:
        connection.close()
    if response.status != 200:
        raise EnrollmentError(f"the authority refuses: {data.decode(errors='replace')[:500]}")
    return data
