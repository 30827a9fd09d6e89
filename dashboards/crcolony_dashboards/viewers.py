"""Rerun's viewers, as processes beside the dashboard: one in a window of its own, one that a browser fetches.

Rerun's command on the PATH is a script that starts the real program and would leave it behind; that program is started
directly. On Linux it ends with the dashboard, however that ends.
"""

import ctypes
import os
import signal
import socket
import subprocess
import sys
import time
import webbrowser
from collections.abc import Callable
from pathlib import Path
from urllib.parse import quote

from crcolony_dashboards.rerun_check import DashboardError, check_port

_PATIENCE_S = 20.0
_GRACE_S = 3.0


class Viewer:
    """A viewer that runs; one that is ours ends with us."""

    def __init__(self, arguments: list[str], is_ours: bool = True) -> None:
        try:
            self._process = subprocess.Popen(
                [str(rerun_program()), *arguments],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,
                preexec_fn=_ending_with_us() if is_ours else None,
            )
        except OSError as error:
            raise DashboardError(f"the viewer does not start: {error.strerror}") from None

    @property
    def pid(self) -> int:
        """Of its process."""
        return self._process.pid

    @property
    def ended(self) -> int | None:
        """Its exit code, once it has ended."""
        return self._process.poll()

    def close(self) -> None:
        """End it."""
        if self._process.poll() is None:
            self._process.terminate()
            try:
                self._process.wait(_GRACE_S)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()


def open_native(url: str) -> Viewer:
    """Open a window that shows a dashboard; raises DashboardError where there is no screen."""
    if sys.platform.startswith("linux") and not _has_screen():
        raise DashboardError("--native: there is no screen here; use --web, or a viewer elsewhere")
    return Viewer(["--connect", url, "--bind", "127.0.0.1", "--port", "auto"])


def open_file(path: Path) -> None:
    """Open a window that shows a film, and leave it to itself; raises DashboardError where there is no screen."""
    if sys.platform.startswith("linux") and not _has_screen():
        raise DashboardError("--native: there is no screen here; open the file elsewhere")
    Viewer([str(path)], is_ours=False)


def serve_web(url: str, port: int) -> tuple[Viewer, str]:
    """Serve the viewer to browsers of this machine; return it and the address to open.

    Raises DashboardError if the port is taken or the server does not start.
    """
    check_port(port, "--web-port")
    viewer = Viewer(["--serve-web", "--bind", "127.0.0.1", "--web-viewer-port", str(port), url])
    until_s = time.monotonic() + _PATIENCE_S
    while not _answers(port):
        if viewer.ended is not None or time.monotonic() > until_s:
            viewer.close()
            raise DashboardError(f"127.0.0.1:{port}: the web viewer does not start")
        time.sleep(0.02)
    query = f"url={quote(url, safe='')}&hide_welcome_screen=1&theme=dark&persist=0"
    return viewer, f"http://127.0.0.1:{port}/?{query}"


def open_browser(address: str) -> bool:
    """Open a browser if there is a screen to open it on; return whether one was opened."""
    is_possible = not sys.platform.startswith("linux") or _has_screen()
    return is_possible and webbrowser.open(address)


def rerun_program() -> Path:
    """Return Rerun's program itself; raises DashboardError if it is missing."""
    import rerun_cli  # type: ignore[import-untyped]

    folder = Path(rerun_cli.__file__ or "").parent
    for name in ("rerun", "rerun.exe"):
        if (folder / name).is_file():
            return folder / name
    raise DashboardError(f"{folder}: Rerun's viewer is missing: pip install 'crcolony[viz]'")


def _has_screen() -> bool:
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _answers(port: int) -> bool:
    with socket.socket() as probe:
        probe.settimeout(0.2)
        return probe.connect_ex(("127.0.0.1", port)) == 0


def _ending_with_us() -> Callable[[], None] | None:
    """Return what lets a child end when we do, even by kill -9 (Linux only)."""
    if not sys.platform.startswith("linux"):
        return None
    libc = ctypes.CDLL(None)
    set_death_signal = 1

    def ask_the_kernel() -> None:
        libc.prctl(set_death_signal, signal.SIGTERM)

    return ask_the_kernel
