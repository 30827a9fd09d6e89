"""Viewers are child processes that end with the dashboard; what keeps one from starting is reported in one line."""

import os
import socket
import sys
from pathlib import Path

import pytest
from crcolony_dashboards.preconditions import DashboardError
from crcolony_dashboards.viewers import (
    Viewer,
    open_browser,
    open_file,
    open_native,
    rerun_program,
    serve_web,
)

from crcolony.transport.zenoh_session import free_port
from tests.support.process import wait_until

NO_SERVER = "rerun+http://127.0.0.1:1/proxy"


@pytest.fixture
def no_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    """A Linux machine without a screen."""
    monkeypatch.setattr(sys, "platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)


@pytest.mark.usefixtures("no_screen")
def test_without_a_screen_no_window_is_opened(tmp_path: Path) -> None:
    """The message names an alternative; no browser is opened either."""
    with pytest.raises(DashboardError, match=r"^--native: no screen; use --web"):
        open_native(NO_SERVER)
    with pytest.raises(DashboardError, match=r"^--native: no screen; open the file"):
        open_file(tmp_path / "replay.rrd")
    assert not open_browser("http://127.0.0.1:1")


def test_a_web_port_that_is_taken_is_refused() -> None:
    """The message names its option."""
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        with pytest.raises(DashboardError, match=r"choose another with --web-port$"):
            serve_web(NO_SERVER, other.getsockname()[1])


def test_the_web_viewer_is_served_until_it_is_closed() -> None:
    """Its address has the dashboard's URL; closing it ends its process and frees its port."""
    port = free_port()
    viewer, address = serve_web(NO_SERVER, port)
    try:
        assert address.startswith(f"http://127.0.0.1:{port}/?url=rerun%2Bhttp%3A%2F%2F127.0.0.1")
        with socket.create_connection(("127.0.0.1", port), timeout=5.0):
            pass
        assert viewer.exit_code is None
    finally:
        viewer.close()
    assert viewer.exit_code is not None
    with socket.socket() as probe:
        assert probe.connect_ex(("127.0.0.1", port)) != 0


def test_a_viewer_that_ends_by_itself_has_an_exit_code() -> None:
    """Closing it then does nothing."""
    viewer = Viewer(["--version"])
    wait_until(lambda: viewer.exit_code is not None, "it ends")
    viewer.close()
    assert viewer.exit_code == 0


def test_reruns_program_is_not_the_script_on_the_path() -> None:
    """It is an executable file of the installed package."""
    assert os.access(rerun_program(), os.X_OK)
    assert rerun_program().parent.name == "rerun_cli"
