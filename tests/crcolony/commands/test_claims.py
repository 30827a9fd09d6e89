"""`crcolony claims`: the table of claims, printed or written."""

from pathlib import Path

import pytest

from crcolony.cli import main
from crcolony.experiments.framework import claims_table
from crcolony.experiments.framework.claims_summary import BEGIN, END
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


def test_the_short_form_is_put_into_a_page(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A page that is not there, is no text or has no place for it is refused in one line, and nothing is written."""
    monkeypatch.setattr(claims_table, "read_table", lambda folders: [])
    page, out = tmp_path / "README.md", tmp_path / "claims.md"
    words = ["claims", "folder", "--out", str(out), "--short", str(page)]
    for content in (None, b"no marks\n", b"\xff"):
        if content is not None:
            page.write_bytes(content)
        assert main(words) == 2
        assert capsys.readouterr().err.startswith(f"crcolony: --short {page}: ")
        assert not out.exists()
    page.write_text(f"{BEGIN}\n{END}\n")
    assert main(words) == 0
    assert capsys.readouterr().out == f"{out}\n{page}\n"
    assert "Of 0 claims" in page.read_text("utf-8")
