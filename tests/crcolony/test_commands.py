"""Wrong input to the commands of the network is one line that names what and where, and exit code 2."""

import shlex
import socket
import sqlite3
from pathlib import Path

import pytest

from crcolony.cli import main
from crcolony.protocol.identity import create_key

ENDPOINT = "tcp/127.0.0.1:17447"


def refusal(capsys: pytest.CaptureFixture[str], *words: str | Path) -> str:
    """Run a command that must refuse; return what it says."""
    try:
        code = main([str(word) for word in words])
    except SystemExit as exit_:  # argparse's own way
        code = int(exit_.code or 0)
    said = capsys.readouterr()
    assert code == 2, said
    assert said.err.count("\n") == 1, said.err
    assert "Traceback" not in said.err
    return said.err.strip()


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("launch -n 0", "-n 0: must be at least 1"),
        ("launch -n 3 --robots 2", "-n 3: the arena has 2 slots"),
        ("launch --robots-only --lockstep", "--robots-only: the arena determines the clock"),
        ("launch --minutes 0", "--minutes 0: must be above 0"),
        ("launch --set life.agents=0", "life.agents: expected"),
        ("launch --hz 5 --speed 2", "not allowed with argument --hz"),
        ("arena --hz 0", "--hz 0: must be from 0.001 to 10000"),
        ("arena --speed nan", "--speed nan: must be"),
        ("arena --expect 9 --robots 4", "--expect 9: from 1 to 4, the slots of the arena"),
        ("arena --arena a/b", "--arena 'a/b': letters, digits"),
        ("arena --robots 0", "robots: expected"),
        ("host -n 3 --robots 2", "-n 3: the arena has 2 slots"),
        ("host -n 0", "-n 0: must be at least 1"),
        ("robot --out x --colony 'a b'", "--colony"),
        ("robot --out x --repeatable", "--repeatable needs --number"),
        ("robot --out x --snapshot 0", "--snapshot 0: must be from 0.1 to 86400 seconds"),
        ("robot --out x --connect nowhere", "nowhere: not an endpoint"),
        ("robot --out x --connect tcp/127.0.0.1:99999", "not an endpoint"),
        ("robot --out x --connect tcp/127.0.0.1:²", "not an endpoint"),
        ("robot --out x --interface nosuch0", "interface nosuch0: No such device"),
        ("robot --out x --client --listen tcp/127.0.0.1:1", "--client cannot be used with --listen or --interface"),
        ("robot --out x --key missing", "missing: cannot be read: No such file"),
        ("robot --out x --allow missing", "missing: cannot be read"),
        ("router --client", "--client cannot be used with a router"),
        ("top --seconds 0", "--seconds 0: must be above 0"),
        ("status --seconds -1", "--seconds -1: must be above 0 and at most 600"),
        ("status --client --connect tcp/127.0.0.1:9", "no router answers at tcp/127.0.0.1:9"),
        ("inspect missing", "missing: not a crcolony robot file: there is no such file"),
        ("keygen /proc/none/key", "/proc/none/key: cannot be written"),
        ("plot", "the following arguments are required: FOLDER"),
        ("plot missing", "missing: there is no such folder"),
        ("plot .", ".: neither a run (config.toml) nor a comparison (CONDITION/seed-N/config.toml)"),
        ("plot one other", "several folders: --out is needed, the folder for the figures"),
        ("plot . --format pdf,tiff", "--format pdf,tiff: 'tiff' is not one of pdf, svg, png"),
        ("simulate --seeds 0", "--seeds must be at least 1"),
        ("simulate --robots 1", "--robots 1: must be from 2 to 50"),
    ],
)
def test_wrong_input_is_refused_in_a_line(
    words: str,
    line: str,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Every option that is out of range, every name that cannot be, every endpoint that is none."""
    monkeypatch.chdir(tmp_path)
    assert line in refusal(capsys, *shlex.split(words))


def test_a_port_that_is_taken_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    """With what to do about it."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        endpoint = f"tcp/127.0.0.1:{taken.getsockname()[1]}"
        said = refusal(capsys, "router", "--listen", endpoint)
    assert f"{endpoint}: the port is taken; choose another with --listen" in said


def test_an_address_that_is_not_of_this_machine_is_named(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """It is not said to be taken."""
    said = refusal(capsys, "router", "--listen", "tcp/192.0.2.1:7447")
    assert "tcp/192.0.2.1:7447: this machine has no such address" in said


def test_a_folder_of_another_colony_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """A launch goes on only with the settings it began with, and never into a folder of something else."""
    (tmp_path / "config.toml").write_text("robots = 7\n")
    said = refusal(capsys, "launch", "--out", tmp_path)
    assert f"{tmp_path}: holds a colony of other settings" in said
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "thesis.tex").touch()
    said = refusal(capsys, "launch", "--out", tmp_path / "other")
    assert "not empty; choose another --out" in said


class TestRobotFolders:
    """What is wrong with a robot's own files is said before it comes onto the network."""

    def test_a_key_that_others_may_read(
        self, capsys: pytest.CaptureFixture[str], tmp_path: Path
    ) -> None:
        """It names the file, and how to mend it."""
        create_key(tmp_path / "key")
        (tmp_path / "key").chmod(0o644)
        said = refusal(capsys, "robot", "--out", tmp_path, "--connect", ENDPOINT)
        assert f"{tmp_path / 'key'}: others may read this key; chmod 600" in said

    def test_a_memory_of_a_newer_version(
        self, capsys: pytest.CaptureFixture[str], tmp_path: Path
    ) -> None:
        """An old program does not touch it."""
        refused = tmp_path / "robot.sqlite"
        with sqlite3.connect(refused) as database:
            database.execute("PRAGMA application_id = 0x43524D59")
            database.execute("PRAGMA user_version = 99")
        database.close()
        said = refusal(capsys, "robot", "--out", tmp_path, "--connect", ENDPOINT)
        assert f"{refused}: " in said
        assert "newer" in said

    def test_a_memory_that_is_none(
        self, capsys: pytest.CaptureFixture[str], tmp_path: Path
    ) -> None:
        """A file of something else is left as it is."""
        (tmp_path / "robot.sqlite").write_text(
            "not a database, but long enough to be looked at" * 99
        )
        said = refusal(capsys, "robot", "--out", tmp_path, "--connect", ENDPOINT)
        assert "robot.sqlite: not a crcolony robot file" in said
