"""The desk robot of docs/write_a_driver.md, on a TCP port: it speaks its lines, and obeys its time to live."""

import contextlib
import select
import socket
import threading
import time
from collections.abc import Iterator


class DeskRobotEmulator:
    """One robot; a later connection replaces an earlier one."""

    def __init__(self) -> None:
        self._server = socket.create_server(("127.0.0.1", 0))
        self.address = f"tcp:127.0.0.1:{self._server.getsockname()[1]}"
        self.wheels = (0.0, 0.0)
        self._until_s = 0.0
        self._is_stopped = False
        self._is_closed = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Switch it off."""
        self._is_closed.set()
        self._thread.join()
        self._server.close()

    def _run(self) -> None:
        link: socket.socket | None = None
        rest = b""
        while not self._is_closed.is_set():
            ready, _, _ = select.select([self._server, *([link] if link else [])], [], [], 0.02)
            if self._server in ready:
                if link is not None:
                    link.close()
                link, rest = self._server.accept()[0], b""
            elif link in ready and link is not None:
                data = b""
                with contextlib.suppress(OSError):
                    data = link.recv(4096)
                *lines, rest = (rest + data).split(b"\n")
                for line in lines:
                    self._handle(line.decode().split())
                if not data:
                    link.close()
                    link = None
            if self._is_stopped or time.monotonic() >= self._until_s:
                self.wheels = (0.0, 0.0)
            if link is not None:
                with contextlib.suppress(OSError):
                    left, right = self.wheels
                    link.sendall(f"state {left} {right} 0.8 {int(self._is_stopped)}\n".encode())
        if link is not None:
            link.close()

    def _handle(self, words: list[str]) -> None:
        match words:
            case ["drive", left, right, ttl_s]:
                self.wheels = float(left), float(right)
                self._until_s = time.monotonic() + min(float(ttl_s), 0.5)
            case ["stop"]:
                self._is_stopped = True
            case ["clear"]:
                self._is_stopped = False


@contextlib.contextmanager
def desk_robot() -> Iterator[DeskRobotEmulator]:
    """Run one inside the context."""
    robot = DeskRobotEmulator()
    try:
        yield robot
    finally:
        robot.close()
