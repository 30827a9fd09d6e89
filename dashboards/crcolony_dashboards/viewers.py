"""Rerun's viewers as child processes: the native one in its own window, and the one that is served to browsers.

Rerun's command on the PATH is a script whose child, the actual program, would survive it; that program is started
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

from crcolony_dashboards.preconditions import DashboardError, check_port_is_free

_START_TIMEOUT_S = 20.0
_STOP_TIMEOUT_S = 3.0


class Viewer:
    """A running viewer; one that is attached ends with this process."""

    def __init__(self, arguments: list[str], is_attached: bool = True) -> None:
        try:
            self._process = subprocess.Popen(
                [str(rerun_program()), *arguments],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,
                preexec_fn=_die_with_parent() if is_attached else None,
            )
        except OSError as error:
            raise DashboardError(f"the viewer does not start: {error.strerror}") from None

    @property
    def pid(self) -> int:
        """The id of its process."""
        return self._process.pid

    @property
    def exit_code(self) -> int | None:
        """Its exit code; None while it runs."""
        return self._process.poll()

    def close(self) -> None:
        """Stop it: SIGTERM, and SIGKILL if it does not end in time."""
        if self._process.poll() is None:
            self._process.terminate()
            try:
                self._process.wait(_STOP_TIMEOUT_S)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()


def open_native(url: str) -> Viewer:
    """Open a window that shows a dashboard; raises DashboardError without a screen."""
    if sys.platform.startswith("linux") and not _has_screen():
        raise DashboardError("--native: no screen; use --web, or a viewer on another machine")
    return Viewer(["--connect", url, "--bind", "127.0.0.1", "--port", "auto"])


def open_file(path: Path) -> None:
    """Open a window that shows a recording and outlives this process; raises DashboardError without a screen."""
    if sys.platform.startswith("linux") and not _has_screen():
        raise DashboardError("--native: no screen; open the file on another machine")
    Viewer([str(path)], is_attached=False)


def serve_web(url: str, port: int) -> tuple[Viewer, str]:
    """Serve the viewer to browsers of this machine; return it and the address to open.

    Raises DashboardError if the port is taken or the server does not start.
    """
    check_port_is_free(port, "--web-port")
    viewer = Viewer(["--serve-web", "--bind", "127.0.0.1", "--web-viewer-port", str(port), url])
    deadline_s = time.monotonic() + _START_TIMEOUT_S
    while not _accepts_connections(port):
        if viewer.exit_code is not None or time.monotonic() > deadline_s:
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
    """Return the path of Rerun's program; raises DashboardError if it is missing."""
    import rerun_cli  # type: ignore[import-untyped]

    folder = Path(rerun_cli.__file__ or "").parent
    for name in ("rerun", "rerun.exe"):
        if (folder / name).is_file():
            return folder / name
    raise DashboardError(f"{folder}: Rerun's viewer is missing: pip install 'crcolony[viz]'")


def _has_screen() -> bool:
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _accepts_connections(port: int) -> bool:
    with socket.socket() as probe:
        probe.settimeout(0.2)
        return probe.connect_ex(("127.0.0.1", port)) == 0


def _die_with_parent() -> Callable[[], None] | None:
    """Return a function that a child runs to be ended with this process, even by kill -9 (Linux only)."""
    if not sys.platform.startswith("linux"):
        return None
    libc = ctypes.CDLL(None)
    pr_set_pdeathsig = 1

    def set_death_signal() -> None:
        libc.prctl(pr_set_pdeathsig, signal.SIGTERM)

    return set_death_signal
