"""Whatever a power cut or a failing disk leaves of a file is a clean earlier state, or is refused in one line."""

import contextlib
import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from crcolony.storage.reading import read_stored_robot
from crcolony.storage.sql import StorageError
from crcolony.storage.store import RobotStore, StorageFullError
from tests.support.robot_stores import (
    OTHER,
    Seen,
    answered,
    decision,
    events,
    open_store,
    proposed,
    robot,
    room_for,
    see,
)

LOG_HEADER, FRAME = 32, 24 + 4096


@dataclass(frozen=True)
class Copy:
    """The files right after a transaction, and every state that was on the disk until then."""

    main: bytes
    log: bytes
    states: frozenset[Seen]


def use(store: RobotStore) -> Iterator[None]:
    """Do what a robot does with its file, one transaction after the other."""
    store.begin_incarnation(7)
    yield
    for n in range(1, 13):
        if n % 4 == 1:
            store.save(robot(n), events(n), tick=n)
            yield
        record = proposed(n) if n % 2 else answered(n, peer=OTHER)
        if record.role == "responder":
            store.write([record])
            yield
        decided = replace(record, state="decided" if n % 2 else "mated")
        store.write([decided], decided, decision(n))
        yield
        if n % 3 == 0 and n % 2:
            store.write([replace(decided, state="mated")])
            yield


@cache
def history() -> tuple[Copy, ...]:
    """Return copies after every transaction; the log is moved into the main file now and then, as usual."""
    copies: list[Copy] = []
    states: list[Seen] = []
    with TemporaryDirectory() as folder:
        path = Path(folder) / "robot.sqlite"
        store = open_store(path)
        store._connection.execute("PRAGMA wal_autocheckpoint = 35")
        states.append(see(store))
        for _ in use(store):
            states.append(see(store))
            if states[-1].tick is not None:
                states.append(_without_newest(path, Path(folder) / "old.sqlite"))
            log = path.with_name(path.name + "-wal")
            copies.append(Copy(path.read_bytes(), log.read_bytes(), frozenset(states)))
        store.close()
    return tuple(copies)


def _without_newest(path: Path, other: Path) -> Seen:
    """Return the state of the file if its newest snapshot is lost and there is an older one."""
    files = ((path, other), (_log(path), _log(other)))
    for source, target in files:
        target.write_bytes(source.read_bytes())
    store = open_store(other)
    newest = "(SELECT newest FROM head WHERE older > 0)"
    store._connection.execute(f"UPDATE snapshots SET robot = x'' WHERE serial = {newest}")
    store.close()
    store = open_store(other)
    seen = see(store)
    store.close()
    other.unlink()
    return seen


def _log(path: Path) -> Path:
    return path.with_name(path.name + "-wal")


def open_damaged(folder: Path, copy: Copy, main: bytes, log: bytes) -> Seen | None:
    """Open files after damage; return the state that is found, or None if they are refused."""
    path = folder / "robot.sqlite"
    path.write_bytes(main)
    _log(path).write_bytes(log)
    path.with_name(path.name + "-shm").unlink(missing_ok=True)
    try:
        store = open_store(path)
    except StorageError as refused:
        error = str(refused)
    else:
        return _continue(store, copy)
    assert error.startswith(f"{path}: ")
    assert "\n" not in error
    with contextlib.suppress(StorageError):  # what cannot be written may still be readable
        stored = read_stored_robot(path)
        read = (tuple(stored.matings), tuple(stored.events), stored.tick)
        assert read in {(state.matings, state.events, state.tick) for state in copy.states}
    return None


def _continue(store: RobotStore, copy: Copy) -> Seen:
    """Return the state that is found, which must be one of the earlier ones, and go on from it."""
    seen = see(store)
    assert seen in copy.states
    store.begin_incarnation(9)
    store.save(robot(99), events(99), tick=99)
    assert see(store).tick == 99
    store.close()
    open_store(store.path).close()
    return seen


def test_a_log_cut_anywhere_is_a_clean_earlier_state(tmp_path: Path) -> None:
    """Between two pages or in the middle of one: what was written before is there, or the file is refused."""
    for copy in (history()[8], history()[9], history()[-1]):
        found = set()
        for start in range(LOG_HEADER, len(copy.log) + 1, FRAME):
            for size in (start, start - 1, start + 24 + start % 4096):
                found.add(open_damaged(tmp_path, copy, copy.main, copy.log[:size]))
        assert len(found - {None}) > 1
    assert open_damaged(tmp_path, copy, copy.main, copy.log) in copy.states


def test_before_the_log_is_moved_every_cut_is_an_earlier_state(tmp_path: Path) -> None:
    """A real power cut loses only what was not synced: all of these open, each at least as far as the one before."""
    copy = history()[7]
    reached = []
    for size in range(LOG_HEADER, len(copy.log) + 1, FRAME):
        seen = open_damaged(tmp_path, copy, copy.main, copy.log[:size])
        assert seen is not None
        reached.append((len(seen.events), len(seen.matings), len(seen.since)))
    assert reached == sorted(reached, key=lambda far: far[:2])


def test_a_main_file_cut_anywhere_is_refused_or_whole(tmp_path: Path) -> None:
    """While the log holds every page the file is whole; otherwise it is refused, even when nothing is left."""
    for copy in history()[7::8]:
        for start in range(0, len(copy.main), 4096):
            for size in (start, start + 1 + start % 4095):
                open_damaged(tmp_path, copy, copy.main[:size], copy.log)
        assert open_damaged(tmp_path, copy, b"", copy.log) is None


@pytest.mark.parametrize("seed", range(200))
def test_a_flipped_bit_is_found(tmp_path: Path, seed: int) -> None:
    """One in the main file and one in the log, anywhere: an earlier state is found, or the file is refused."""
    rng = random.Random(seed)
    copy = rng.choice(history())
    assert len(copy.log) > LOG_HEADER
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    open_damaged(tmp_path / "a", copy, _flip(copy.main, rng), copy.log)
    open_damaged(tmp_path / "b", copy, copy.main, _flip(copy.log, rng))


def _flip(content: bytes, rng: random.Random) -> bytes:
    bit = rng.randrange(8 * len(content))
    flipped = bytearray(content)
    flipped[bit // 8] ^= 1 << bit % 8
    return bytes(flipped)


@pytest.mark.parametrize("what", ["begin_incarnation", "write", "save", "delete"])
def test_whichever_write_fails_nothing_is_half_there(tmp_path: Path, what: str) -> None:
    """With a little more room each time, every write of a transaction is once the one that fails."""
    path = tmp_path / "robot.sqlite"
    store = open_store(path)
    for _ in use(store):
        pass
    if what == "delete":
        store._connection.execute("UPDATE snapshots SET robot = x'' WHERE serial > 12")
    store.close()
    store = open_store(path)
    record = proposed(50)
    acts: dict[str, Callable[[], object]] = {
        "begin_incarnation": lambda: store.begin_incarnation(50),
        "write": lambda: store.write([record, answered(51)], record, decision(50)),
        "save": lambda: store.save(robot(50), events(50), tick=50),
        "delete": lambda: store.save(robot(50), events(50), tick=50),
    }
    before = see(store), read_stored_robot(path).incarnation
    failures = 0
    for size in range(0, 40 * FRAME, 1030):
        try:
            with room_for(size):
                acts[what]()
        except StorageFullError:
            failures += 1
            assert (see(store), read_stored_robot(path).incarnation) == before
        else:
            break
    else:
        pytest.fail("no attempt succeeded")
    after = see(store), read_stored_robot(path).incarnation
    assert after != before
    assert failures > 4
    store.close()
    store = open_store(path)
    assert (see(store), read_stored_robot(path).incarnation) == after
    store.close()


def test_a_file_that_cannot_be_created_can_be_created_later(tmp_path: Path) -> None:
    """Whichever write of its creation fails, it is refused in one line, and with more room it succeeds."""
    path = tmp_path / "robot.sqlite"
    failures = 0
    for size in range(0, 20 * FRAME, 1030):
        try:
            with room_for(size):
                store = open_store(path)
        except StorageError:
            failures += 1
        else:
            break
    assert failures > 10
    assert store.load() is None
    store.close()
