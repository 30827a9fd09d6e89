"""The folder of a member's credentials, as enrollment and renewal write it."""

from dataclasses import dataclass
from pathlib import Path

import msgspec

from crcolony.durable_files import create_secret, replace_file
from crcolony.protocol.codec import WireError
from crcolony.protocol.identity import Identity, load_key
from crcolony.protocol.roster import MemberName, Role, open_roster
from crcolony.storage.files import make_folder
from crcolony.transport.credentials import (
    AUTHORITY_FILE,
    IDENTITY_FILE,
    MEMBER_FILE,
    ROSTER_FILE,
    MemberRecord,
)
from crcolony_deploy.certificates import (
    CertificateError,
    Validity,
    common_name_of,
    is_issued_by,
    new_key,
    public_half,
    public_key_of,
    request_certificate,
    validity_of,
)
from crcolony_deploy.membership_request import Grant, MembershipRequest, RequestError, proof_of

_ENROLMENT = "enrollment.json"
_NEXT_KEY = "next_key.pem"
"""The key of a request that waits for its certificate."""


class _Enrollment(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    at: str
    robot_keys: list[str]
    arenas: list[str]


@dataclass(frozen=True)
class Applicant:
    """What a member is to be: its role and name, the robots for which it speaks, and the arenas it carries."""

    role: Role
    name: MemberName
    robots: tuple[Identity, ...] = ()
    arenas: tuple[str, ...] = ()

    @property
    def common_name(self) -> str:
        """The subject of the certificate."""
        return f"{self.role}.{self.name}"


def request_membership(folder: Path, applicant: Applicant) -> MembershipRequest:
    """Make a new secret key in the folder, and return the request for its certificate; raises FolderError, OSError."""
    make_folder(folder)
    key = new_key()
    (folder / _NEXT_KEY).unlink(missing_ok=True)
    create_secret(folder / _NEXT_KEY, key)
    signing_request = request_certificate(key, applicant.common_name).decode()
    proofs = tuple(proof_of(robot, signing_request) for robot in applicant.robots)
    return MembershipRequest(
        applicant.role, applicant.name, signing_request, proofs, applicant.arenas
    )


def install_grant(folder: Path, grant: Grant) -> None:
    """Write what was granted into the folder of the request; raises RequestError if it does not fit.

    What processes read is replaced file by file, and each as a whole; the identity comes last.
    """
    _check_grant(grant)
    try:
        key = (folder / _NEXT_KEY).read_bytes()
    except OSError as error:
        raise RequestError(f"{folder / _NEXT_KEY}: {error.strerror}; request first") from None
    certificate = grant.certificate.encode()
    if public_key_of(certificate) != public_half(key):
        raise RequestError(f"{folder}: this certificate is for another request")
    replace_file(folder / AUTHORITY_FILE, lambda file: file.write(grant.authority.encode()))
    replace_file(folder / ROSTER_FILE, lambda file: file.write(grant.roster))
    record = msgspec.json.format(msgspec.json.encode(grant.record)) + b"\n"
    replace_file(folder / MEMBER_FILE, lambda file: file.write(record))
    (folder / _NEXT_KEY).unlink()
    create_secret(folder / _NEXT_KEY, key + certificate)
    (folder / _NEXT_KEY).replace(folder / IDENTITY_FILE)


def write_enrollment(folder: Path, at: str, robot_keys: list[Path], arenas: list[str]) -> None:
    """Write what a renewal needs to know: where the authority is, and for whom the member speaks."""
    keys = [str(key.resolve()) for key in robot_keys]
    data = msgspec.json.format(msgspec.json.encode(_Enrollment(at, keys, arenas))) + b"\n"
    replace_file(folder / _ENROLMENT, lambda file: file.write(data))


def read_enrollment(folder: Path) -> tuple[Applicant, str]:
    """Return the member whose credentials are in a folder, and the address of its authority.

    Raises RequestError, IdentityError.
    """
    try:
        enrollment = msgspec.json.decode((folder / _ENROLMENT).read_bytes(), type=_Enrollment)
        record = msgspec.json.decode((folder / MEMBER_FILE).read_bytes(), type=MemberRecord)
    except OSError as error:
        raise RequestError(f"{error.filename}: {error.strerror}") from None
    except msgspec.DecodeError as error:
        raise RequestError(f"{folder}: {error}") from None
    robots = tuple(load_key(Path(key)) for key in enrollment.robot_keys)
    return Applicant(record.role, record.name, robots, tuple(enrollment.arenas)), enrollment.at


def validity_in(folder: Path) -> Validity:
    """Return when the certificate in a folder of credentials is valid; raises RequestError, CertificateError."""
    try:
        return validity_of((folder / IDENTITY_FILE).read_bytes())
    except OSError as error:
        raise RequestError(f"{error.filename}: {error.strerror}") from None


def _check_grant(grant: Grant) -> None:
    """Raise RequestError unless the parts of a grant belong together."""
    certificate, authority = grant.certificate.encode(), grant.authority.encode()
    try:
        key = grant.record.key_bytes
        is_consistent = (
            common_name_of(certificate) == grant.record.common_name
            and is_issued_by(certificate, authority)
            and public_key_of(authority) == key
        )
        open_roster(grant.roster, key)
    except (CertificateError, ValueError, WireError) as error:
        raise RequestError(f"what was granted is damaged: {error}") from None
    if not is_consistent:
        raise RequestError("what was granted is of several authorities or members")
