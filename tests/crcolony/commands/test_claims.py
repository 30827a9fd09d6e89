"""`crcolony claims`: the table of claims, printed or written."""

from pathlib import Path

import pytest

from crcolony.cli import main
from crcolony.experiments.framework import claims_table
from tests.support.command_line import Refused


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("claims", "the following arguments are required: FOLDER"),
        ("claims missing", "missing: not the results of an experiment: experiment.json is missing"),
    ],
)
def test_wrong_options_are_refused_in_one_line(words: str, line: str, refused: Refused) -> None:
    """The line names the folder, and the reason."""
    assert line in refused(words)


def test_the_table_is_printed_or_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Into a file, whose folder is made; what cannot be written is one line."""
    monkeypatch.setattr(claims_table, "read_table", lambda folders: [])
    assert main(["claims", "folder"]) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("# Claims\n")
    assert main(["claims", "folder", "--out", str(tmp_path / "docs" / "claims.md")]) == 0
    assert (tmp_path / "docs" / "claims.md").read_text("utf-8") == printed
    capsys.readouterr()
    assert main(["claims", "folder", "--out", str(tmp_path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
