"""An inventory is printed as what runs where, for people and for the playbook; or line by line what is wrong."""

import json
from pathlib import Path

import pytest
from crcolony_deploy.errors import DeployError
from crcolony_deploy.print_plan import check_inventory

from tests.support.inventories import GOOD, write


@pytest.fixture(autouse=True)
def _open_network(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CRCOLONY_OPEN_NETWORK", "yes")


def test_people_read_what_runs_where(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With ports."""
    path = write(tmp_path, GOOD)
    check_inventory(path, as_json=False)
    assert capsys.readouterr().out.splitlines() == [
        "field (10.0.0.1)",
        "    arena pond, port 7447",
        "ada (10.0.0.2)",
        "    robot ada, port 7447",
        "    robot adele, port 7448",
        "bob (10.0.0.3)",
        "    robot bob, port 7447",
        f"{path}: valid",
    ]


def test_the_playbook_reads_units_options_and_the_manifest(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Paths on this computer are relative to the inventory; a wheelhouse may be collected later."""
    path = write(tmp_path, GOOD)
    check_inventory(path, as_json=True)
    bob = json.loads(capsys.readouterr().out)["bob"]
    assert bob["services"][0]["unit"] == "crcolony-robot@bob.service"
    assert bob["services"][0]["options_file"] == "/etc/crcolony/robot-bob.env"
    assert bob["wheelhouse"] == str(tmp_path / "wheelhouse")
    assert bob["manifest"] is None
    (tmp_path / "wheelhouse").mkdir()
    (tmp_path / "wheelhouse/manifest.json").write_text('{"id": "1+a"}')
    check_inventory(path, as_json=True)
    assert json.loads(capsys.readouterr().out)["bob"]["manifest"] == {"id": "1+a"}
    (tmp_path / "wheelhouse/manifest.json").write_text("{")
    with pytest.raises(DeployError, match="damaged"):
        check_inventory(path, as_json=True)


def test_each_problem_is_a_line_the_last_with_how_many(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """So that all can be mended at once."""
    path = write(tmp_path, GOOD.replace("[bob]", "[ada]").replace("10.0.0.3", "10.0.0.2"))
    with pytest.raises(DeployError, match=r"robot ada is also on ada \(2 problems\)"):
        check_inventory(path, as_json=False)
    assert capsys.readouterr().out == f"{path}: host bob: has the address of ada: 10.0.0.2\n"
