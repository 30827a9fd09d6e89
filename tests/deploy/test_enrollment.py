"""Members enroll and renew over the network: with the authority that invited them, and nobody else in their name."""

import contextlib
import http.client
import socket
import ssl
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import msgspec
import pytest
from crcolony_deploy.authority import Authority, AuthoritySettings
from crcolony_deploy.enrollment_client import EnrollmentError, enroll, renew
from crcolony_deploy.enrollment_service import EnrollmentService, serving
from crcolony_deploy.invitations import InvitationBook, fingerprint_of
from crcolony_deploy.member_folder import Applicant, request_membership, validity_in

from crcolony.protocol.identity import Identity
from crcolony.transport.credentials import load_credentials

HOST = "127.0.0.1"
KITCHEN = Applicant("robot", "kitchen", (Identity(bytes(32)),))
HALL = Applicant("robot", "hall", (Identity(bytes([1]) * 32),))


class Served(NamedTuple):
    """A running service, and what it has printed."""

    folder: Path
    port: int
    lines: list[str]

    def invitation(self, applicant: Applicant = KITCHEN) -> str:
        with Authority.opened(self.folder) as authority:
            pin = InvitationBook(self.folder).invite(
                applicant.role, applicant.name, time.time(), 60.0
            )
            return f"{pin}-{fingerprint_of(authority.identity.public_key)}"


@contextlib.contextmanager
def served_in(folder: Path) -> Iterator[Served]:
    Authority.create(folder, AuthoritySettings("lab"))
    lines: list[str] = []
    service = EnrollmentService(folder, lines.append)
    with serving(service, folder, HOST, 0) as port:
        yield Served(folder, port, lines)


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Served]:
    with served_in(tmp_path / "authority") as one:
        yield one


def test_a_member_enrolls_with_a_pin_and_renews_with_its_certificate(
    served: Served, tmp_path: Path
) -> None:
    """The folder is then what a process needs."""
    folder = tmp_path / "kitchen"
    enroll(HOST, served.port, served.invitation(), KITCHEN, folder)
    first = (folder / "identity.pem").read_bytes()
    assert load_credentials(folder).record.common_name == "robot.kitchen"
    renew(HOST, served.port, request_membership(folder, KITCHEN), folder)
    assert (folder / "identity.pem").read_bytes() != first
    assert validity_in(folder).ends_unix_s > 0.0
    assert served.lines == ["robot.kitchen is enrolled", "robot.kitchen has another certificate"]


def test_an_impostor_of_the_authority_learns_no_pin(served: Served, tmp_path: Path) -> None:
    """The invitation names the authority; another one at its address is not asked."""
    with served_in(tmp_path / "impostor") as impostor:
        with pytest.raises(EnrollmentError, match="not the authority that has written"):
            enroll(HOST, impostor.port, served.invitation(), KITCHEN, tmp_path / "kitchen")
        assert impostor.lines == []


def test_a_member_cannot_play_the_authority(served: Served, tmp_path: Path) -> None:
    """Its certificate is of the same authority, and of another name."""
    folder = tmp_path / "kitchen"
    enroll(HOST, served.port, served.invitation(), KITCHEN, folder)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(folder / "identity.pem")
    with socket.create_server((HOST, 0)) as listener:

        def answer() -> None:
            connection, _ = listener.accept()
            with contextlib.suppress(OSError), context.wrap_socket(connection, server_side=True):
                pass

        threading.Thread(target=answer, daemon=True).start()
        port, request = listener.getsockname()[1], request_membership(folder, KITCHEN)
        with pytest.raises(EnrollmentError, match="a member of the colony, not its authority"):
            renew(HOST, port, request, folder)


def test_nobody_renews_in_the_name_of_another_member(served: Served, tmp_path: Path) -> None:
    """Neither with the certificate of its own name, nor without any."""
    kitchen, hall = tmp_path / "kitchen", tmp_path / "hall"
    enroll(HOST, served.port, served.invitation(), KITCHEN, kitchen)
    enroll(HOST, served.port, served.invitation(HALL), HALL, hall)
    with pytest.raises(EnrollmentError, match="a member renews its own certificate"):
        renew(HOST, served.port, request_membership(tmp_path / "x", HALL), kitchen)
    context = ssl.create_default_context(cafile=str(kitchen / "authority.pem"))
    context.check_hostname = False
    connection = http.client.HTTPSConnection(HOST, served.port, context=context)
    request = msgspec.json.encode(request_membership(tmp_path / "x", HALL))
    connection.request("POST", "/renew", request)
    assert connection.getresponse().status == 403
    connection.close()


def test_a_revoked_member_gets_no_further_certificate(served: Served, tmp_path: Path) -> None:
    """So its last one ends its connections."""
    folder = tmp_path / "kitchen"
    enroll(HOST, served.port, served.invitation(), KITCHEN, folder)
    with Authority.opened(served.folder) as authority:
        authority.revoke("kitchen")
    before = (folder / "identity.pem").read_bytes()
    with pytest.raises(EnrollmentError, match=r"robot\.kitchen is revoked"):
        renew(HOST, served.port, request_membership(folder, KITCHEN), folder)
    assert (folder / "identity.pem").read_bytes() == before


def test_pins_are_not_guessed_faster_than_two_a_second(served: Served, tmp_path: Path) -> None:
    """Whatever member they are for."""
    invitation = served.invitation()
    fingerprint = invitation.partition("-")[2]
    for _ in range(12):
        with pytest.raises(EnrollmentError):
            enroll(HOST, served.port, f"00000000-{fingerprint}", HALL, tmp_path / "x")
    assert any("too many attempts" in line for line in served.lines)


def test_connections_that_say_nothing_do_not_keep_members_out(
    served: Served, tmp_path: Path
) -> None:
    """Each has a thread, and there is a limit on them; noise and long requests are refused."""
    with contextlib.ExitStack() as idle:
        for _ in range(20):
            idle.enter_context(socket.create_connection((HOST, served.port)))
        enroll(HOST, served.port, served.invitation(), KITCHEN, tmp_path / "kitchen")
    context = ssl.create_default_context(cafile=str(tmp_path / "kitchen/authority.pem"))
    context.check_hostname = False
    for path, body, length, status in (
        ("/enroll", b"noise", 5, 403),
        ("/enroll", b"", 2_000_000, 413),
        ("/renew", b"{}", 2, 403),
        ("/other", b"", 0, 404),
    ):
        connection = http.client.HTTPSConnection(HOST, served.port, context=context, timeout=5.0)
        connection.request("POST", path, body, {"Content-Length": str(length)})
        assert connection.getresponse().status == status
        connection.close()


def test_an_authority_that_is_not_there_is_named(tmp_path: Path) -> None:
    """In one line."""
    with pytest.raises(EnrollmentError, match="Connection refused"):
        enroll(HOST, 1, f"01234567-{fingerprint_of(bytes(32))}", KITCHEN, tmp_path / "kitchen")
