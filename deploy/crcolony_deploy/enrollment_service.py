"""The service of an authority over HTTPS: it enrolls members by PIN, and renews certificates of members.

Nobody in the colony needs it to live. It is away without harm for two thirds of a certificate's life.
"""

import contextlib
import datetime
import ssl
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import msgspec

from crcolony.errors import CrcolonyError
from crcolony.rate_limit import TokenBucket
from crcolony_deploy.authority import Authority
from crcolony_deploy.certificates import new_key, request_certificate, sign_request
from crcolony_deploy.invitations import InvitationBook, InvitationError
from crcolony_deploy.membership_request import (
    MAX_REQUEST_BYTES,
    Grant,
    RequestError,
    decode_request,
)

SERVICE_NAME = "authority"
"""Common name of the service's own certificate; no member can have it, as their names have a role."""
_SERVICE_DAYS = 365
_TIMEOUT_S = 10.0
_MAX_CONNECTIONS = 32
_MAX_ENROLMENTS_PER_S = 2.0
"""A PIN is guessed at most this often, whatever member it is for; the hash of one takes 50 ms."""


class EnrollmentRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a member sends to enroll."""

    pin: str
    request: msgspec.Raw


class EnrollmentService:
    """Serves an authority. Each connection has a thread; the authority's folder is locked for every change."""

    def __init__(self, folder: Path, print_line: Callable[[str], None]) -> None:
        self._folder, self._print_line = folder, print_line
        self._limit = TokenBucket(_MAX_ENROLMENTS_PER_S)
        self._mutex = threading.Lock()
        with Authority.opened(folder) as authority:
            self.authority_pem = authority.certificate
            self.colony = authority.settings.colony

    def enroll(self, body: bytes) -> Grant:
        """Admit a member that has a valid PIN; raises CrcolonyError."""
        with self._mutex:
            if not self._limit.allow(time.monotonic()):
                raise InvitationError("too many attempts at the moment")
        try:
            enrollment = msgspec.json.decode(body, type=EnrollmentRequest)
        except msgspec.DecodeError as error:
            raise RequestError(f"not a request: {error}") from None
        request = decode_request(bytes(enrollment.request))
        with Authority.opened(self._folder) as authority:
            InvitationBook(self._folder).use(
                request.role, request.name, enrollment.pin, time.time()
            )
            grant = authority.admit(request)
        self._print_line(f"{grant.record.common_name} is enrolled")
        return grant

    def renew(self, body: bytes, common_name: str) -> Grant:
        """Give a member its next certificate; `common_name` is that of the one it has. Raises CrcolonyError."""
        request = decode_request(body)
        if not common_name or request.member.common_name != common_name:
            raise RequestError("a member renews its own certificate, with the one it has")
        with Authority.opened(self._folder) as authority:
            if authority.roster.find(common_name) is None:
                raise RequestError(f"{common_name} is no member")
            grant = authority.admit(request)
        self._print_line(f"{common_name} has another certificate")
        return grant

    def refuse(self, error: CrcolonyError) -> None:
        """Note what was refused."""
        self._print_line(f"refused: {error}")


class _Handler(BaseHTTPRequestHandler):
    """Answers one connection."""

    server: "_Server"
    timeout = _TIMEOUT_S
    server_version = "crcolony"
    sys_version = ""

    def do_GET(self) -> None:
        """Return the authority's certificate, of which an invitation has the fingerprint."""
        if self.path == "/authority":
            self._reply(200, self.server.service.authority_pem)
        else:
            self._reply(404, b"")

    def do_POST(self) -> None:
        """Enroll, or renew."""
        service = self.server.service
        actions: dict[str, Callable[[bytes], Grant]] = {
            "/enroll": service.enroll,
            "/renew": lambda body: service.renew(body, _common_name(self.connection)),
        }
        length = self.headers.get("Content-Length", "")
        if self.path not in actions or not length.isdecimal():
            self._reply(404, b"")
        elif int(length) > MAX_REQUEST_BYTES:
            self._reply(413, b"too long")
        else:
            self._answer(actions[self.path], self.rfile.read(int(length)))

    def _answer(self, action: Callable[[bytes], Grant], body: bytes) -> None:
        try:
            grant = action(body)
        except CrcolonyError as error:
            self.server.service.refuse(error)
            self._reply(403, str(error).encode())
        else:
            self._reply(200, msgspec.json.encode(grant))

    def _reply(self, status: int, body: bytes) -> None:
        self.send_response(status)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_: Any) -> None:
        """Print nothing: what happens is printed by the service."""


class _Server(ThreadingHTTPServer):
    daemon_threads = True

    def __init__(
        self, address: tuple[str, int], service: EnrollmentService, context: ssl.SSLContext
    ) -> None:
        self.service, self._context = service, context
        self._free = threading.BoundedSemaphore(_MAX_CONNECTIONS)
        super().__init__(address, _Handler)

    def process_request(self, request: Any, client_address: Any) -> None:
        """Give a connection a thread, or close it if there are too many."""
        if self._free.acquire(blocking=False):
            super().process_request(request, client_address)
        else:
            self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Shake hands on the connection's own thread: one that does not answer delays nobody else."""
        try:
            request.settimeout(_TIMEOUT_S)
            with contextlib.suppress(OSError):
                secured = self._context.wrap_socket(request, server_side=True)
                super().process_request_thread(secured, client_address)
        finally:
            self._free.release()

    def handle_error(self, *_: Any) -> None:
        """Forget a connection that has failed."""


@contextlib.contextmanager
def serving(service: EnrollmentService, folder: Path, host: str, port: int) -> Iterator[int]:
    """Serve inside the context; yields the port. Raises OSError if it cannot be listened on."""
    context = _server_context(folder)
    server = _Server((host, port), service, context)
    thread = threading.Thread(target=server.serve_forever, args=(0.1,), daemon=True)
    thread.start()
    try:
        yield server.server_address[1]
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


def _server_context(folder: Path) -> ssl.SSLContext:
    """Return the TLS settings of the service, with a certificate made now; members show theirs if they have one."""
    with Authority.opened(folder) as authority:
        key = new_key()
        certificate = sign_request(
            request_certificate(key, SERVICE_NAME),
            SERVICE_NAME,
            authority.seed,
            authority.certificate,
            datetime.timedelta(days=_SERVICE_DAYS),
            authority.now(),
        )
        pem = authority.certificate
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_3
    context.verify_mode = ssl.CERT_OPTIONAL
    context.load_verify_locations(cadata=pem.decode())
    with tempfile.NamedTemporaryFile() as identity:  # readable for its owner only
        identity.write(key + certificate)
        identity.flush()
        context.load_cert_chain(identity.name)
    return context


def _common_name(connection: Any) -> str:
    """Return the common name of the certificate at the other end; empty if it has shown none."""
    subject = (connection.getpeercert() or {}).get("subject", ())
    names = [value for part in subject for key, value in part if key == "commonName"]
    return names[0] if len(names) == 1 else ""
