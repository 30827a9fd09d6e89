"""`crcolony deploy` checks inventories, and refuses kinds of hosts for which nothing can be collected."""

from pathlib import Path

import pytest

from crcolony.cli import main
from tests.support.command_line import refusal
from tests.support.inventories import GOOD, write


def test_a_valid_inventory_is_printed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It ends with 0."""
    monkeypatch.setenv("CRCOLONY_OPEN_NETWORK", "yes")
    assert main(["deploy", "check", str(write(tmp_path, GOOD))]) == 0
    assert capsys.readouterr().out.endswith("inventory.yml: valid\n")


def test_a_wrong_inventory_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """In one line."""
    path = write(tmp_path, GOOD.replace("[field]", "[feild]").replace("ada:", "ada:", 1))
    assert "did you mean field?" in refusal(capsys, "deploy", "check", path)


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (("--machine", "pdp11"), "--machine 'pdp11': one of x86_64, aarch64"),
        (("--extra", "all"), "--extra 'all': one of bridge, deploy, viz"),
        (("--python", "2.7"), "crcolony needs 3.11 or newer"),
        (("--source", "/nowhere"), "no checkout of crcolony"),
    ],
)
def test_what_cannot_be_collected_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: tuple[str, ...], reason: str
) -> None:
    """Nothing is made."""
    assert reason in refusal(capsys, "deploy", "wheelhouse", tmp_path / "out", *words)
    assert not (tmp_path / "out").exists()
