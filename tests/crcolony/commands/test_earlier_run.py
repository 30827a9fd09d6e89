"""Commands start from an earlier run, go on in their own folder, and leave every other folder alone."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from crcolony.cli import main
from crcolony.protocol.identity import create_key
from crcolony.recordings.telemetry_file import TelemetryFile
from crcolony.results.colony_folder import open_colony_folder
from crcolony.storage.claimed_folder import claim_folder
from crcolony.storage.store import RobotStore
from tests.support.command_line import FAST, Refused, hash_of, refusal
from tests.support.run_folders import bytes_of, run
from tests.support.small_colony import small


def _evolve(folder: Path) -> None:
    run(folder, small("generations=1"))


def _sweep(folder: Path) -> None:
    with claim_folder(folder, "evolve --seeds") as claimed:
        claimed.begin()
    _evolve(folder / "implicit" / "seed-1")


def _launch(folder: Path) -> None:
    with open_colony_folder(folder, "launch", small(), None) as made:
        _robot(made.prepare_robot(0))
        _arena(made.prepare_arena())


def _host(folder: Path) -> None:
    with open_colony_folder(folder, "host", small(), None) as made:
        _robot(made.prepare_robot(0))


def _robot(folder: Path) -> None:
    identity = create_key(folder / "key")
    RobotStore(folder / "robot.sqlite", identity.id, bytes(16), durable=False).close()


def _arena(folder: Path) -> None:
    with claim_folder(folder, "arena") as claimed:
        (claimed.path / "arena.npz").touch()
        claimed.begin()


def _dashboard(folder: Path) -> None:
    TelemetryFile.open(folder / "telemetry.sqlite").close()


def _user(folder: Path) -> None:
    folder.mkdir(parents=True)
    (folder / "thesis.tex").write_text("precious")


MAKERS: dict[str, Callable[[Path], None]] = {
    "evolve": _evolve,
    "evolve --seeds": _sweep,
    "launch": _launch,
    "host": _host,
    "robot": _robot,
    "arena": _arena,
    "dashboard": _dashboard,
    "a user": _user,
}
COMMANDS = {
    "evolve": "evolve",
    "evolve --resume": "evolve",
    "evolve --seeds 2": "evolve --seeds",
    "launch": "launch",
    "host": "host",
    "robot": "robot",
    "arena": "arena",
    "dashboard --no-recording": "",  # refuses any --out
    "dashboard": "dashboard",
}
"""What a user types, and what may be made by it."""
TOGETHER = {
    *((owner, "dashboard") for owner in ("launch", "host", "arena", "a user")),
    ("a user", "robot"),
    ("a user", "arena"),
    ("evolve", "evolve --resume"),
    *((command, command) for command in ("launch", "host", "robot", "arena", "dashboard")),
}
"""What is not refused."""


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of every maker, with its name."""
    place = tmp_path_factory.mktemp("folders")
    for name, make in MAKERS.items():
        make(place / name)
    return place


@pytest.mark.parametrize("owner", MAKERS)
@pytest.mark.parametrize("words", COMMANDS)
def test_no_command_touches_the_folder_of_another(
    folders: Path, capsys: pytest.CaptureFixture[str], owner: str, words: str
) -> None:
    """It is refused in one line that names the folder, and every byte in it is as it was."""
    if (owner, words) in TOGETHER:
        return
    before = bytes_of(folders)
    line = refusal(capsys, *words.split(), "--out", folders / owner)
    assert str(folders / owner) in line or "--no-recording" in line
    assert bytes_of(folders) == before
    if owner in ("evolve", "launch", "host", "robot") and words in ("evolve", "launch", "host"):
        assert f"crcolony {words} --from" in line


@pytest.mark.parametrize("words", ["export {run} --out", "plot {run} --out"])
def test_figures_and_tables_are_not_put_into_the_folder_of_a_run(
    folders: Path, capsys: pytest.CaptureFixture[str], words: str
) -> None:
    """One of its own is needed."""
    before = bytes_of(folders)
    run_folder = str(folders / "evolve")
    for owner in set(MAKERS) - {"a user"}:
        command = [word.format(run=run_folder) for word in words.split()]
        line = refusal(capsys, *command, folders / owner)
        assert "choose another --out" in line
    assert bytes_of(folders) == before


@pytest.mark.parametrize("command", ["evolve", "launch", "host", "robot --out new"])
def test_a_run_that_robots_cannot_begin_with_is_refused(command: str, refused: Refused) -> None:
    """In one line, and before anything is made."""
    for words, line in (
        ("--from runs/7", "runs/7: there is no such folder"),
        ("--from .", ".: not the folder of a run"),
        ("--generation 3", "--generation needs --from"),
    ):
        assert line in refused(f"{command} {words}")
    assert not Path("runs").exists()
    assert not Path("new").exists()


def test_options_that_exclude_an_earlier_run_are_refused(refused: Refused) -> None:
    """A resumed run has its own robots, and a sweep is of random ones."""
    assert "cannot be used with --from" in refused("evolve --resume --out a --from b")
    assert "--from cannot be used with --seeds" in refused("evolve --seeds 2 --from b")


@pytest.mark.parametrize("command", ["evolve", "launch", "host", "robot --out new"])
def test_other_genes_are_refused_before_anything_is_made(
    folders: Path, command: str, refused: Refused
) -> None:
    """The settings of the earlier run are taken, changed by --set."""
    run_folder = folders / "evolve"
    words = f"{command} --from '{run_folder}' --set learning.potential_distances=3"
    assert "its robots have other genes: only there: foraging.potential.12" in refused(words)
    assert not Path("runs").exists()
    assert not Path("new").exists()


def test_a_run_from_another_has_its_settings_and_robots(
    folders: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The same start gives the same history, and the earlier run may be gone when it is resumed."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(folders / "evolve", "source")
    hashes = []
    for out in ("a", "b"):
        assert (
            main(["evolve", "--no-plots", "--from", "source", "--set", "seed=9", "--out", out]) == 0
        )
        hashes.append(hash_of(capsys.readouterr().out))
    assert hashes[0] == hashes[1]
    assert main(["evolve", "--seed", "9", *FAST, "--generations", "1", "--out", "c"]) == 0
    assert hash_of(capsys.readouterr().out) != hashes[0]
    shutil.rmtree("source")
    assert main(["evolve", "--resume", "--no-plots", "--out", "a"]) == 0
    assert hash_of(capsys.readouterr().out) == hashes[0]
    assert main(["evolve", "--no-plots", "--from", "a", "--robots", "6", "--out", "d"]) == 0
    assert "the subpopulations of 4 robots dealt out again to 6" in capsys.readouterr().out


def test_a_colony_goes_on_with_the_run_it_began_with_only(
    folders: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Another --from, or one for robots that began with random genotypes, is refused."""
    line = refusal(capsys, "launch", "--from", folders / "evolve", "--out", folders / "launch")
    assert "did not begin with those of a run" in line
