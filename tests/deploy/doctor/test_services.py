"""systemd is asked for every unit: which do not run, and which had to be started again."""

from pathlib import Path

import pytest
from crcolony_deploy.doctor.services import check_services

from tests.support.examined_hosts import answer, host_of, lines, service


@pytest.mark.parametrize(
    ("state", "found"),
    [
        ("ActiveState=active\nNRestarts=0", ["ok: 1 of 1 services run"]),
        ("ActiveState=failed\nNRestarts=0", ["problem: crcolony-robot@ada.service is failed"]),
        (
            "ActiveState=activating\nStatusText=compiling, 40 %",
            ["problem: crcolony-robot@ada.service is not ready yet: compiling, 40 %"],
        ),
        (
            "ActiveState=active\nNRestarts=3",
            [
                "warning: crcolony-robot@ada.service was restarted 3 times",
                "ok: 1 of 1 services run",
            ],
        ),
    ],
)
def test_what_systemd_says_of_a_unit_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, state: str, found: list[str]
) -> None:
    """With where to look."""
    answer(monkeypatch, tmp_path, "systemctl", state)
    assert lines(check_services(host_of(tmp_path, service("robot", "ada")))) == found


def test_a_host_without_services_is_no_problem(tmp_path: Path) -> None:
    """But it is said."""
    assert lines(check_services(host_of(tmp_path))) == [
        "warning: no service of crcolony is installed here"
    ]
