"""A folder belongs to what made it, and to one process at a time."""

import multiprocessing
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from crcolony.storage.claimed_folder import (
    check_folder,
    check_output_folder,
    claim_folder,
    existing_run_advice,
)
from crcolony.storage.files import FolderError
from crcolony.storage.folder_record import FolderRecord, Maker, read_record, write_record
from tests.support.process import wait_until


def _claim_numbered(count: int) -> list[str]:
    claimed = [claim_folder(None, "evolve") for _ in range(count)]
    return [str(one.path) for one in claimed]


def test_the_next_free_number_is_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An empty folder, or a file, has its number too."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "runs" / "2").mkdir(parents=True)
    (tmp_path / "runs" / "3").touch()
    assert _claim_numbered(2) == ["runs/1", "runs/4"]


def test_those_who_ask_at_a_time_get_folders_of_their_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Making a folder must succeed: that another one looked free is not enough."""
    monkeypatch.chdir(tmp_path)
    with ThreadPoolExecutor(8) as pool:
        names = [name for made in pool.map(_claim_numbered, [12] * 8) for name in made]
    assert len(names) == len(set(names)) == 96


def test_a_folder_is_new_once(tmp_path: Path) -> None:
    """The same command goes on in it, while no other process does."""
    with claim_folder(tmp_path / "a" / "b", "launch") as claimed:
        assert claimed.is_new
        claimed.begin("seed = 1\n")
        with pytest.raises(FolderError, match="in use by another run"):
            claim_folder(claimed.path, "launch")
    with claim_folder(claimed.path, "launch") as again:
        assert not again.is_new
    assert (claimed.path / "config.toml").read_text() == "seed = 1\n"
    record = read_record(claimed.path)
    assert record is not None
    assert record.made_by == "launch"


def _claim_and_wait(folder: Path) -> None:
    claim_folder(folder, "launch").begin()
    multiprocessing.Event().wait()


def test_a_folder_is_free_after_its_process_was_killed(tmp_path: Path) -> None:
    """The lock is the operating system's."""
    process = multiprocessing.get_context("spawn").Process(target=_claim_and_wait, args=[tmp_path])
    process.start()
    wait_until((tmp_path / "made_by.toml").exists, "the folder is claimed")
    with pytest.raises(FolderError, match="in use"):
        claim_folder(tmp_path, "launch")
    process.kill()
    process.join()
    claim_folder(tmp_path, "launch").close()


def test_what_could_not_be_started_leaves_nothing_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A folder that was there before is empty again; of others the parents go, too."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "old").mkdir()
    for folder in (Path("new"), Path("a/b/c"), None, tmp_path / "old"):
        claimed = claim_folder(folder, "evolve")
        claimed.begin("seed = 1\n")
        claimed.discard()
    assert [path.name for path in tmp_path.iterdir()] == ["old"]
    assert not any((tmp_path / "old").iterdir())


@pytest.mark.parametrize(
    ("owner", "maker", "advice"),
    [
        ("evolve", "launch", "crcolony launch --from {}"),
        ("evolve", "host", "crcolony host --from {}"),
        ("evolve", "robot", "crcolony robot --from {} --out NEW"),
        ("launch", "evolve", "crcolony evolve --from {}"),
        ("host", "launch", "crcolony launch --from {}"),
        ("robot", "launch", "crcolony launch --from {}"),
        ("evolve", "dashboard", "crcolony replay {}"),
        ("evolve --seeds", "launch", "crcolony launch --from {}/…/seed-1"),
        ("arena", "launch", "choose another --out"),
        ("dashboard", "evolve", "choose another --out"),
        ("launch", "evolve --seeds", "choose another --out"),
        ("evolve", "arena", "choose another --out"),
        ("launch", "arena", "choose another --out"),
    ],
)
def test_the_folder_of_another_command_is_refused_with_what_to_do(
    tmp_path: Path, owner: Maker, maker: Maker, advice: str
) -> None:
    """And is not touched; not even its lock is taken."""
    write_record(tmp_path, FolderRecord(owner))
    before = (tmp_path / "made_by.toml").read_bytes()
    with claim_folder(tmp_path, owner), pytest.raises(FolderError) as refused:
        claim_folder(tmp_path, maker)
    assert f"made by crcolony {owner}" in str(refused.value)
    assert advice.format(tmp_path) in str(refused.value)
    assert "\n" not in str(refused.value)
    assert [path.name for path in tmp_path.iterdir()] == ["made_by.toml"]
    assert (tmp_path / "made_by.toml").read_bytes() == before


@pytest.mark.parametrize("owner", ["launch", "host", "arena", "dashboard"])
def test_a_dashboard_records_beside_what_it_shows(tmp_path: Path, owner: Maker) -> None:
    """Its files have names of their own."""
    write_record(tmp_path, FolderRecord(owner))
    check_folder(tmp_path, "dashboard")


def test_the_files_of_a_user_are_left_alone(tmp_path: Path) -> None:
    """A run needs a folder of its own; a robot, an arena and a dashboard add their files to any."""
    check_folder(tmp_path / "missing", "evolve")
    (tmp_path / "thesis.tex").touch()
    alone: tuple[Maker, ...] = ("evolve", "evolve --seeds", "experiment", "launch", "host")
    anywhere: tuple[Maker, ...] = ("robot", "arena", "dashboard")
    for maker in alone:
        with pytest.raises(FolderError, match="not empty; choose another --out"):
            check_folder(tmp_path, maker)
        with pytest.raises(FolderError, match="a file, not a folder"):
            check_folder(tmp_path / "thesis.tex", maker)
    for maker in anywhere:
        check_folder(tmp_path, maker)


def test_figures_and_tables_are_not_written_between_the_files_of_a_run(tmp_path: Path) -> None:
    """But into any other folder, one inside of it too."""
    write_record(tmp_path, FolderRecord("evolve"))
    with pytest.raises(FolderError, match="made by crcolony evolve; choose another --out, as in"):
        check_output_folder(tmp_path)
    check_output_folder(tmp_path / "figures")


def test_advice_can_be_typed(tmp_path: Path) -> None:
    """Names with spaces are quoted."""
    assert f"--resume --out '{tmp_path}/a b';" in existing_run_advice(tmp_path / "a b")
