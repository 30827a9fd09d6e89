"""`crcolony export`: export recorded telemetry."""

from pathlib import Path

import pytest

from crcolony.cli import main
from tests.support.command_line import Refused
from tests.support.run_folders import run
from tests.support.small_colony import small


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("export missing", "missing"),
    ],
)
def test_wrong_options_are_refused_in_one_line(words: str, line: str, refused: Refused) -> None:
    """The line names the option or file, and the reason."""
    assert line in refused(words)


def test_the_lineage_of_a_run_is_beside_its_tables(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """And is printed as the tables are."""
    run(tmp_path / "run", small("generations=1"))
    assert main(["export", str(tmp_path / "run")]) == 0
    path = tmp_path / "run" / "parquet" / "phylogeny.csv"
    assert capsys.readouterr().out.splitlines()[-1] == str(path)
    assert path.read_text().startswith("id,ancestor_list,origin_time,destruction_time,")
