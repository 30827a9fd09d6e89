"""A recording holds all samples, survives kill -9 and a full disk, and is not mistaken for another file."""

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
    TelemetryFile,
    read_samples,
)
from crcolony.recordings.telemetry_schema import TelemetryError
from crcolony.telemetry.samples import RawSample
from tests.support.raw_samples import record

NOW_MS = 1_790_000_000_000
raw_samples = st.builds(
    RawSample,
    st.sampled_from(("online", "offline", "state", "event", "scene", "history", "metadata")),
    st.text(st.characters(codec="utf-8"), max_size=40),
    st.binary(max_size=300),
    st.integers(0, 2**53),
)

WRITER = """
import sys
from pathlib import Path
from crcolony.telemetry.samples import RawSample
from crcolony.recordings.telemetry_file import TelemetryFile
file = TelemetryFile.open(Path(sys.argv[1]))
for number in range(10**9):
    file.add(RawSample("event", "key", b"%d " % number * 100, number))
    if number % 100 == 99:
        print(file.commit() or number, flush=True)
"""


def event(number: int, size: int = 10) -> RawSample:
    return RawSample("event", f"key/{number}", bytes([number % 256]) * size, NOW_MS + number)


@given(st.lists(st.lists(raw_samples, max_size=20), max_size=5))
@settings(max_examples=50)
def test_samples_are_read_in_the_order_of_their_arrival(
    portions: list[list[RawSample]],
) -> None:
    """Byte by byte, after every commit and at the end."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "telemetry.sqlite"
        file = TelemetryFile.open(path)
        samples: list[RawSample] = []
        for portion in portions:
            for sample in portion:
                file.add(sample)
            samples += portion
            assert file.commit() is None
            assert list(read_samples(path)) == samples
        assert file.close() is None
        assert list(read_samples(path)) == samples
        assert os.listdir(folder) == [path.name]


def test_samples_of_some_kinds_can_be_read_alone(tmp_path: Path) -> None:
    """In order."""
    path = tmp_path / "t.sqlite"
    metadata = RawSample("metadata", "key", b"{}", NOW_MS)
    record(path, [event(1), metadata, event(2), metadata])
    assert list(read_samples(path, ["metadata"])) == [metadata, metadata]


def test_a_file_can_be_read_while_it_is_recorded(tmp_path: Path) -> None:
    """The reader does not block the writer, and reaches the last sample."""
    path = tmp_path / "t.sqlite"
    file = TelemetryFile.open(path)
    read = []
    file.add(event(0))
    file.commit()
    for sample in read_samples(path):
        read.append(sample)
        if len(read) < 1000:
            file.add(event(len(read)))
            assert file.commit() is None
    assert read == [event(number) for number in range(1000)]
    file.close()


def test_a_recording_is_continued_and_robots_that_were_online_are_recorded_as_offline(
    tmp_path: Path,
) -> None:
    """Robots that are online still come online again; those that were offline are not recorded twice."""
    path = tmp_path / "new" / "t.sqlite"
    one, other = (RawSample("online", f"robot/{k}", b"", NOW_MS + k) for k in range(2))
    record(path, [one, other, one._replace(kind="offline"), event(7)])
    record(path, [other])
    ended = RawSample("offline", other.key, b"", event(7).unix_ms)
    assert list(read_samples(path))[3:] == [event(7), ended, other]


class TestScenes:
    """Of scenes about 100 kB a second are kept; of other samples all."""

    @staticmethod
    def recorded_scenes(path: Path, arenas: int, size: int, seconds: int) -> list[RawSample]:
        """Record ten scenes a second of each arena, with a state beside each; return the scenes that are kept."""
        file = TelemetryFile.open(path)
        for tenth in range(10 * seconds):
            for arena in range(arenas):
                for kind in ("state", "scene"):
                    unix_ms = NOW_MS + 100 * tenth + arena
                    file.add(RawSample(kind, f"arena/{arena}", bytes(size), unix_ms))
            file.commit()
        file.close()
        kept = list(read_samples(path))
        assert sum(sample.kind == "state" for sample in kept) == 10 * seconds * arenas
        return [sample for sample in kept if sample.kind == "scene"]

    def test_scenes_of_a_few_robots_are_kept(self, tmp_path: Path) -> None:
        """All of them."""
        assert len(self.recorded_scenes(tmp_path / "t.sqlite", 1, 1_000, 10)) == 100

    @pytest.mark.parametrize(("arenas", "size"), [(1, 100_000), (1, 12_000), (3, 40_000)])
    def test_scenes_of_many_robots_are_downsampled(
        self, tmp_path: Path, arenas: int, size: int
    ) -> None:
        """To the limit, about."""
        seconds = 40
        kept = self.recorded_scenes(tmp_path / "t.sqlite", arenas, size, seconds)
        assert sum(len(sample.payload) for sample in kept) == pytest.approx(
            SCENE_BYTES_PER_S * seconds, rel=0.25
        )


def test_too_much_at_once_is_dropped_and_counted(tmp_path: Path) -> None:
    """Memory is bounded, even without commits."""
    path = tmp_path / "t.sqlite"
    file = TelemetryFile.open(path)
    for number in range(100):
        file.add(event(number, size=2**20))
    assert 30 < file.dropped < 40
    assert file.close() is None
    assert len(list(read_samples(path))) == 100 - file.dropped


def test_kill_9_loses_the_samples_after_the_last_commit_and_no_others(tmp_path: Path) -> None:
    """A process is killed while it writes; its recording can be read and continued."""
    path = tmp_path / "t.sqlite"
    words = [sys.executable, "-c", WRITER, str(path)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as writer:
        assert writer.stdout is not None
        for _ in range(30):
            writer.stdout.readline()
        writer.send_signal(signal.SIGKILL)
        printed = writer.stdout.read().split()
    numbers = [sample.unix_ms for sample in read_samples(path)]
    assert numbers == list(range(len(numbers)))
    last = int(printed[-1]) if printed else 2999
    assert len(numbers) in (last + 1, last + 101)
    record(path, [event(1)])
    assert len(list(read_samples(path))) == len(numbers) + 1


def test_a_full_disk_ends_the_recording_with_one_line(tmp_path: Path) -> None:
    """The samples on the disk can be read; the process continues, and prints nothing more."""
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
    numbers = [sample.unix_ms for sample in read_samples(path)]
    assert numbers == list(range(int(good[-1]) + 1))


def test_a_recording_ends_before_the_disk_is_full(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The rest is left to robots on the same disk; the reason is returned once."""
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
    record(path, [event(number, 1000) for number in range(100)])
    os.truncate(path, path.stat().st_size // 2)


def _truncated_header(path: Path) -> None:
    record(path, [event(1)])
    os.truncate(path, 50)


def _of_another_application(path: Path) -> None:
    with closing(sqlite3.connect(path)) as database:
        database.execute("CREATE TABLE births (tick INTEGER)")


def _of_another_version(path: Path) -> None:
    record(path, [event(1)])
    with closing(sqlite3.connect(path)) as database, database:
        database.execute("UPDATE meta SET value = '3' WHERE name = 'version'")


def _with_an_invalid_row(path: Path) -> None:
    record(path, [event(1)])
    with closing(sqlite3.connect(path)) as database, database:
        database.execute("UPDATE samples SET payload = 'text'")


@pytest.mark.parametrize(
    "make",
    [
        _truncated,
        _truncated_header,
        _of_another_application,
        _of_another_version,
        lambda path: path.write_text("states\n" * 1000),
        lambda path: path.mkdir(),
    ],
)
def test_what_is_no_recording_is_named_and_stays_as_it_is(tmp_path: Path, make: object) -> None:
    """When it is read or continued: in one line, with the reason."""
    path = tmp_path / "t.sqlite"
    make(path)  # type: ignore[operator]
    before = path.read_bytes() if path.is_file() else b""
    for use in (lambda: list(read_samples(path)), lambda: TelemetryFile.open(path)):
        with pytest.raises(TelemetryError) as refused:
            use()
        assert str(refused.value).startswith(f"{path}: ")
        assert "\n" not in str(refused.value)
    assert (path.read_bytes() if path.is_file() else b"") == before


@pytest.mark.parametrize("make", [lambda path: None, Path.touch, _with_an_invalid_row])
def test_a_file_without_samples_is_named(tmp_path: Path, make: object) -> None:
    """A file that is missing or empty, or holds what is no sample."""
    path = tmp_path / "t.sqlite"
    make(path)  # type: ignore[operator]
    with pytest.raises(TelemetryError, match=f"^{path}: "):
        list(read_samples(path))


def test_a_recording_can_start_in_an_empty_file(tmp_path: Path) -> None:
    """As a process leaves it that was killed at once."""
    path = tmp_path / "t.sqlite"
    path.touch()
    record(path, [event(1)])
    assert list(read_samples(path)) == [event(1)]


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    """With the reason."""
    (tmp_path / "file").touch()
    with pytest.raises(
        TelemetryError, match=r"t\.sqlite: cannot be written: (Not a directory|File exists)"
    ):
        TelemetryFile.open(tmp_path / "file" / "t.sqlite")
