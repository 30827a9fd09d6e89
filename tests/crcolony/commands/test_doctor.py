"""`crcolony doctor` ends with 0 where all is well, with 1 where there is a problem."""

import json
from pathlib import Path

import pytest

from crcolony.cli import main
from tests.support.command_line import refusal
from tests.support.deployment import Deployment
from tests.support.examined_hosts import answer


def test_a_problem_is_a_line_with_the_remedy_and_exit_code_1(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Once its service runs it is none any more."""
    (tmp_path / "router-west.env").write_text("OPTIONS=--listen tcp/127.0.0.1:1\n")
    words = ["doctor", "--services", str(tmp_path), "--only", "services"]
    answer(monkeypatch, tmp_path, "systemctl", "ActiveState=failed")
    assert main(words) == 1
    line = capsys.readouterr().out
    assert line.startswith("PROBLEM services: crcolony-router@west.service is failed; journalctl")
    answer(monkeypatch, tmp_path, "systemctl", "ActiveState=active\nNRestarts=0")
    assert main([*words, "--json"]) == 0
    (found,) = json.loads(capsys.readouterr().out)
    assert (found["level"], found["check"]) == ("ok", "services")


def test_with_a_time_it_waits_until_all_is_well(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As a playbook does after a start."""
    (tmp_path / "router-west.env").write_text("OPTIONS=\n")
    counted = tmp_path / "bin/systemctl"
    answer(monkeypatch, tmp_path, "systemctl", "")
    mark = tmp_path / "asked"
    counted.write_text(
        f"#!/bin/sh\n[ -e {mark} ] && echo ActiveState=active || echo ActiveState=activating\n"
        f"touch {mark}\n"
    )
    words = ["doctor", "--services", str(tmp_path), "--only", "services"]
    assert main([*words, "--within", "30"]) == 0


def test_a_person_s_credentials_are_examined_without_any_service(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Certificate, membership, and the proof that access control is in force."""
    me = Deployment(tmp_path / "deployment").member("operator", "me")
    checks = [
        word for check in ("certificates", "membership", "access") for word in ("--only", check)
    ]
    words = ["doctor", "--services", str(tmp_path), "--credentials", str(me), *checks]
    assert main(words) == 0
    assert "access: operator.me as peer: access control is in force" in capsys.readouterr().out
    (me / "authority.pem").unlink()
    assert main(words) == 1
    assert "PROBLEM certificates: " in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (("--only", "disc"), "did you mean disk?"),
        (("--seconds", "0"), "--seconds 0: must be above 0"),
        (("--within", "-1"), "--within -1: must be from 0 to 3600"),
    ],
)
def test_wrong_options_are_refused(
    capsys: pytest.CaptureFixture[str], words: tuple[str, ...], reason: str
) -> None:
    """In one line."""
    assert reason in refusal(capsys, "doctor", *words)
