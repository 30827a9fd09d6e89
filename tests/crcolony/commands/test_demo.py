"""`crcolony demo`: evolve a colony for some seconds, then let its robots live as processes."""

from pathlib import Path

import pytest

from tests.support.command_line import Refused, refusal
from tests.support.run_folders import bytes_of


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("demo -n 0", "-n 0: must be at least 1"),
        ("demo --seconds 0", "--seconds 0: must be above 0"),
        ("demo --minutes 0", "--minutes 0: must be above 0"),
        ("demo --hz 0", "--hz 0: must be from 0.001 to 1000"),
        ("demo --set life.agents=0", "life.agents: expected"),
        ("demo -n 20 --set arena.width_m=1.0", "-n 20: robots: 20 do not fit"),
    ],
)
def test_wrong_options_are_refused_in_one_line(words: str, line: str, refused: Refused) -> None:
    """The line names the option or file, and the reason; nothing is made."""
    assert line in refused(words)
    assert not Path("runs").exists()


def test_a_folder_of_a_demo_is_not_used_again(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """The line says how to go on with the robots in it, and with their evolution."""
    (tmp_path / "made_by.toml").write_text('made_by = "demo"\n')
    before = bytes_of(tmp_path)
    line = refusal(capsys, "demo", "--out", tmp_path)
    assert f"crcolony launch --out {tmp_path}/live" in line
    assert f"crcolony evolve --resume --out {tmp_path}/evolved" in line
    line = refusal(capsys, "launch", "--out", tmp_path)
    assert f"crcolony launch --from {tmp_path}/evolved" in line
    line = refusal(capsys, "launch", "--from", tmp_path)
    assert f"give {tmp_path}/evolved or {tmp_path}/live" in line
    assert bytes_of(tmp_path) == before
