"""The air between emulated robots: what one sends by infrared arrives at all others, while they face each other."""

import contextlib
import os
import select
import threading
import tty
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

_REOPEN_S = 0.2
"""How soon a robot that was switched off is heard again after it is on."""


class IrAir:
    """Carries bytes between the infrared links of emulated robots on a thread."""

    def __init__(self, links: Sequence[Path]) -> None:
        self.is_clear = True
        """Whether the robots face each other: otherwise all bytes are lost"""
        self.carried_bytes = 0
        self._links = list(links)
        self._ports: dict[Path, int] = {}
        self._wake, self._woken = os.pipe()
        self._thread = threading.Thread(target=self._carry, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop carrying."""
        os.write(self._woken, b"x")
        self._thread.join()
        for port in (*self._ports.values(), self._wake, self._woken):
            os.close(port)

    def _carry(self) -> None:
        while True:
            self._open_missing()
            ready, _, _ = select.select([*self._ports.values(), self._wake], [], [], _REOPEN_S)
            if self._wake in ready:
                return
            for link, port in list(self._ports.items()):
                if port in ready:
                    self._pass_on(link, port)

    def _through(self, data: bytes) -> bytes:
        """Return what of these bytes arrives."""
        return data

    def _open_missing(self) -> None:
        for link in self._links:
            if link not in self._ports:
                with contextlib.suppress(OSError):
                    port = os.open(link, os.O_RDWR | os.O_NOCTTY)
                    tty.setraw(port)
                    self._ports[link] = port

    def _pass_on(self, link: Path, port: int) -> None:
        try:
            data = os.read(port, 4096)
        except OSError:  # its robot is switched off
            data = b""
        if not data:
            os.close(self._ports.pop(link))
            return
        self.carried_bytes += len(data)
        data = self._through(data)
        for other in list(self._ports.values()):
            if other != port and self.is_clear:
                with contextlib.suppress(OSError):
                    os.write(other, data)


@contextmanager
def ir_air(links: Sequence[Path]) -> Iterator[IrAir]:
    """Let emulated robots face each other inside the context."""
    air = IrAir(links)
    try:
        yield air
    finally:
        air.close()
