"""A recording holds what was heard, survives kill -9 and a full disk, and is not taken for something else."""

import itertools
import os
import resource
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
from contextlib import closing
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from crcolony.recordings.telemetry_file import (
    SCENE_BYTES_PER_S,
    TelemetryError,
    TelemetryFile,
    read_samples,
)
from crcolony.telemetry.colony_monitor import TelemetrySample

NOW_MS = 1_790_000_000_000
SAID = st.builds(
    TelemetrySample,
    st.sampled_from(("alive", "gone", "state", "event", "scene", "history", "metadata")),
    st.text(st.characters(codec="utf-8"), max_size=40),
    st.binary(max_size=300),
    st.integers(0, 2**53),
)

WRITER = """
import sys
from pathlib import Path
from crcolony.telemetry.colony_monitor import TelemetrySample
from crcolony.recordings.telemetry_file import TelemetryFile
file = TelemetryFile.open(Path(sys.argv[1]))
for number in range(10**9):
    file.add(TelemetrySample("event", "key", b"%d " % number * 100, number))
    if number % 100 == 99:
        print(file.commit() or number, flush=True)
"""


def event(number: int, size: int = 10) -> TelemetrySample:
    return TelemetrySample("event", f"key/{number}", bytes([number % 256]) * size, NOW_MS + number)


def record(path: Path, *sample: TelemetrySample) -> None:
    file = TelemetryFile.open(path)
    for one in sample:
        file.add(one)
    assert file.close() is None


@given(st.lists(st.lists(SAID, max_size=20), max_size=5))
@settings(max_examples=50)
def test_what_is_heard_is_read_in_order(portions: list[list[TelemetrySample]]) -> None:
    """Byte by byte, after every commit and at the end."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "telemetry.sqlite"
        file = TelemetryFile.open(path)
        sample: list[TelemetrySample] = []
        for portion in portions:
            for one in portion:
                file.add(one)
            sample += portion
            assert file.commit() is None
            assert list(read_samples(path)) == sample
        assert file.close() is None
        assert list(read_samples(path)) == sample
        assert os.listdir(folder) == [path.name]


def test_some_kinds_can_be_read_alone(tmp_path: Path) -> None:
    """In order."""
    path = tmp_path / "t.sqlite"
    about = TelemetrySample("metadata", "key", b"{}", NOW_MS)
    record(path, event(1), about, event(2), about)
    assert list(read_samples(path, ["metadata"])) == [about, about]


def test_a_reader_goes_on_while_more_is_recorded(tmp_path: Path) -> None:
    """It is in nobody's way, and comes to all that there is."""
    path = tmp_path / "t.sqlite"
    file = TelemetryFile.open(path)
    read = []
    file.add(event(0))
    file.commit()
    for one in read_samples(path):
        read.append(one)
        if len(read) < 1000:
            file.add(event(len(read)))
            assert file.commit() is None
    assert read == [event(number) for number in range(1000)]
    file.close()


def test_a_recording_goes_on_and_who_was_there_is_gone(tmp_path: Path) -> None:
    """Who is there still is heard of again; whoever was gone is not gone twice."""
    path = tmp_path / "new" / "t.sqlite"
    one, other = (TelemetrySample("alive", f"robot/{k}", b"", NOW_MS + k) for k in range(2))
    record(path, one, other, one._replace(kind="gone"), event(7))
    record(path, other)
    ended = TelemetrySample("gone", other.key, b"", event(7).unix_ms)
    assert list(read_samples(path))[3:] == [event(7), ended, other]


class TestScenes:
    """Of scenes no more is kept than about 100 kB a second; of everything else all."""

    @staticmethod
    def record(path: Path, arenas: int, size: int, seconds: int) -> list[TelemetrySample]:
        """Record ten scenes a second of each arena, with a state beside each; return what is kept."""
        file = TelemetryFile.open(path)
        for tenth in range(10 * seconds):
            for arena in range(arenas):
                for kind in ("state", "scene"):
                    unix_ms = NOW_MS + 100 * tenth + arena
                    file.add(TelemetrySample(kind, f"arena/{arena}", bytes(size), unix_ms))
            file.commit()
        file.close()
        kept = list(read_samples(path))
        assert sum(one.kind == "state" for one in kept) == 10 * seconds * arenas
        return [one for one in kept if one.kind == "scene"]

    def test_those_of_a_few_robots_are_kept(self, tmp_path: Path) -> None:
        """All of them."""
        assert len(self.record(tmp_path / "t.sqlite", 1, 1_000, 10)) == 100

    @pytest.mark.parametrize(("arenas", "size"), [(1, 100_000), (1, 12_000), (3, 40_000)])
    def test_those_of_a_crowd_are_thinned_out(self, tmp_path: Path, arenas: int, size: int) -> None:
        """Evenly over time, and over arenas."""
        seconds = 40
        kept = self.record(tmp_path / "t.sqlite", arenas, size, seconds)
        assert sum(len(one.data) for one in kept) == pytest.approx(
            SCENE_BYTES_PER_S * seconds, rel=0.25
        )
        for arena in range(arenas):
            times = [one.unix_ms for one in kept if one.key == f"arena/{arena}"]
            share = len(kept) / arenas
            assert len(times) == pytest.approx(share, rel=0.3)
            gaps_s = [(b - a) / 1000.0 for a, b in itertools.pairwise(times)]
            assert max(gaps_s) < 4.0 * seconds / share


def test_too_much_at_once_is_counted_and_not_kept(tmp_path: Path) -> None:
    """Memory is bounded, even if nobody commits."""
    path = tmp_path / "t.sqlite"
    file = TelemetryFile.open(path)
    for number in range(100):
        file.add(event(number, size=2**20))
    assert 30 < file.dropped < 40
    assert file.close() is None
    assert len(list(read_samples(path))) == 100 - file.dropped


def test_kill_9_loses_what_came_after_the_last_commit_and_nothing_else(tmp_path: Path) -> None:
    """A process that writes is killed in the middle of it; its recording can be read, and goes on."""
    path = tmp_path / "t.sqlite"
    words = [sys.executable, "-c", WRITER, str(path)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as writer:
        assert writer.stdout is not None
        for _ in range(30):
            writer.stdout.readline()
        writer.send_signal(signal.SIGKILL)
        said = writer.stdout.read().split()
    numbers = [one.unix_ms for one in read_samples(path)]
    assert numbers == list(range(len(numbers)))
    last = int(said[-1]) if said else 2999
    assert len(numbers) in (last + 1, last + 101)
    record(path, event(1))
    assert len(list(read_samples(path))) == len(numbers) + 1


def test_a_full_disk_ends_the_recording_with_one_word(tmp_path: Path) -> None:
    """What was on the disk before can be read; the process goes on, and says nothing more."""
    path, limit = tmp_path / "t.sqlite", 1_000_000
    script = WRITER.replace("10**9", "20_000")
    done = subprocess.run(
        [sys.executable, "-c", script, str(path)],
        capture_output=True,
        text=True,
        timeout=60,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)),
    )
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    trouble = [line for line in lines if not line.isdigit()]
    assert len(trouble) == 1
    assert trouble[0].startswith(f"{path}: not recorded any more: ")
    good = lines[: lines.index(trouble[0])]
    assert len(good) > 5
    numbers = [one.unix_ms for one in read_samples(path)]
    assert numbers == list(range(int(good[-1]) + 1))


def test_recording_ends_while_there_is_room_for_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A disk that is nearly full is left to the robots' memories; that is said once."""
    file = TelemetryFile.open(tmp_path / "t.sqlite")
    file.add(event(1))
    assert file.commit() is None
    usage = shutil.disk_usage(tmp_path)
    monkeypatch.setattr(shutil, "disk_usage", lambda path: usage._replace(free=2**20))
    file.add(event(2))
    assert file.commit() == f"{file.path}: not recorded any more: No space left on device"
    file.add(event(3))
    assert file.commit() is None
    assert file.close() is None
    assert list(read_samples(file.path)) == [event(1)]


def _truncated(path: Path) -> None:
    record(path, *(event(number, 1000) for number in range(100)))
    os.truncate(path, path.stat().st_size // 2)


def _cut_to_the_bone(path: Path) -> None:
    record(path, event(1))
    os.truncate(path, 50)


def _of_another(path: Path) -> None:
    with closing(sqlite3.connect(path)) as database:
        database.execute("CREATE TABLE births (tick INTEGER)")


def _of_another_version(path: Path) -> None:
    record(path, event(1))
    with closing(sqlite3.connect(path)) as database, database:
        database.execute("UPDATE meta SET value = '2' WHERE name = 'version'")


def _with_a_strange_row(path: Path) -> None:
    record(path, event(1))
    with closing(sqlite3.connect(path)) as database, database:
        database.execute("UPDATE heard SET data = 'text'")


@pytest.mark.parametrize(
    "make",
    [
        _truncated,
        _cut_to_the_bone,
        _of_another,
        _of_another_version,
        lambda path: path.write_text("states\n" * 1000),
        lambda path: path.mkdir(),
    ],
)
def test_what_is_no_recording_is_named_and_left_alone(tmp_path: Path, make: object) -> None:
    """For reading and for going on: in one line, with the reason."""
    path = tmp_path / "t.sqlite"
    make(path)  # type: ignore[operator]
    before = path.read_bytes() if path.is_file() else b""
    for use in (lambda: list(read_samples(path)), lambda: TelemetryFile.open(path)):
        with pytest.raises(TelemetryError) as refused:
            use()
        assert str(refused.value).startswith(f"{path}: ")
        assert "\n" not in str(refused.value)
    assert (path.read_bytes() if path.is_file() else b"") == before


@pytest.mark.parametrize("make", [lambda path: None, Path.touch, _with_a_strange_row])
def test_what_holds_nothing_to_read_is_named(tmp_path: Path, make: object) -> None:
    """A file that is missing, or empty, or holds what was never heard."""
    path = tmp_path / "t.sqlite"
    make(path)  # type: ignore[operator]
    with pytest.raises(TelemetryError, match=f"^{path}: "):
        list(read_samples(path))


def test_an_empty_file_is_one_to_begin_with(tmp_path: Path) -> None:
    """It is all that is left of a process that was killed at once."""
    path = tmp_path / "t.sqlite"
    path.touch()
    record(path, event(1))
    assert list(read_samples(path)) == [event(1)]


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    """With the reason."""
    (tmp_path / "file").touch()
    with pytest.raises(
        TelemetryError, match=r"t\.sqlite: cannot be written: (Not a directory|File exists)"
    ):
        TelemetryFile.open(tmp_path / "file" / "t.sqlite")
