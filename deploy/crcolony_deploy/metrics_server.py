"""Serves metrics over HTTP, to a few clients at a time, none of which can keep it busy."""

import contextlib
import socket
import socketserver
import threading
from collections.abc import Iterator
from typing import Any
from wsgiref.simple_server import WSGIRequestHandler, WSGIServer

from prometheus_client.exposition import make_wsgi_app
from prometheus_client.registry import CollectorRegistry

from crcolony.errors import CrcolonyError

MAX_CLIENTS = 8
"""Requests at one time; further connections are closed."""
_REQUEST_TIMEOUT_S = 5.0
"""A client that sends or reads nothing for so long is disconnected."""


class MetricsError(CrcolonyError):
    """Metrics cannot be served: the message names the address and the reason."""


def parse_address(text: str) -> tuple[str, int]:
    """Return host and port of `127.0.0.1:9464` or `[::1]:9464`, port 0 for a free one; raises MetricsError."""
    host, _, port = text.rpartition(":")
    host = host.removeprefix("[").removesuffix("]")
    if not host or not port.isascii() or not port.isdecimal() or not 0 <= int(port[:6]) < 65536:
        raise MetricsError(f"{text!r}: expected an address and a port, as in 127.0.0.1:9464")
    return host, int(port)


@contextlib.contextmanager
def serving(registry: CollectorRegistry, text: str) -> Iterator[str]:
    """Serve a registry at an address inside the context; yields the URL. Raises MetricsError."""
    host, port = parse_address(text)
    try:
        family, _, _, _, where = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        server = type("Server", (_Server,), {"address_family": family})(where, _Handler)
    except (OSError, UnicodeError, OverflowError) as error:
        reason = getattr(error, "strerror", None) or error
        raise MetricsError(f"{text}: cannot be listened at: {reason}") from None
    server.set_app(make_wsgi_app(registry))
    thread = threading.Thread(target=server.serve_forever, name="metrics server", daemon=True)
    thread.start()
    try:
        yield f"http://{f'[{host}]' if ':' in host else host}:{server.server_port}/metrics"
    finally:
        server.shutdown()
        server.server_close()


class _Handler(WSGIRequestHandler):
    timeout = _REQUEST_TIMEOUT_S

    def log_message(self, format: str, *args: Any) -> None:
        """Log nothing: every few seconds is a request."""


class _Server(socketserver.ThreadingMixIn, WSGIServer):
    daemon_threads = True
    block_on_close = False

    def __init__(self, *arguments: Any) -> None:
        self._free = threading.Semaphore(MAX_CLIENTS)
        super().__init__(*arguments)

    def server_bind(self) -> None:
        """Bind without asking the DNS for this machine's name, as the base class does."""
        socketserver.TCPServer.server_bind(self)
        self.server_name, self.server_port = str(self.server_address[0]), self.server_address[1]
        self.setup_environ()

    def process_request(self, request: Any, client_address: Any) -> None:
        if not self._free.acquire(blocking=False):
            self.shutdown_request(request)
            return
        super().process_request(request, client_address)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._free.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore a client that is gone, or too slow."""
