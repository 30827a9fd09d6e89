"""`crcolony metrics` refuses what it cannot do with one line."""

import sys
from pathlib import Path

import pytest

from crcolony.transport.zenoh_session import free_port
from tests.support.command_line import refusal


def test_without_its_library_one_line_says_what_to_install(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is an extra that robots do not need."""
    for name in list(sys.modules):
        if name.startswith("crcolony_deploy"):
            monkeypatch.delitem(sys.modules, name)
        elif name.startswith("prometheus_client."):
            monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.setitem(sys.modules, "prometheus_client", None)
    line = refusal(capsys, "metrics")
    assert line.endswith("pip install 'crcolony[deploy]'")


def test_where_nobody_answers_that_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    """One line with the endpoint and why."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    line = refusal(capsys, "metrics", "--connect", endpoint, "--seconds", "0.1")
    assert f"answers at {endpoint}" in line


def test_a_list_of_no_robots_is_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """It would export nothing, for ever."""
    (tmp_path / "robots").write_text("# nobody\n")
    line = refusal(capsys, "metrics", "--robots", tmp_path / "robots")
    assert line.endswith("robots: lists no robot")
