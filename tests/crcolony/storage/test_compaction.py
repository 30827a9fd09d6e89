"""A robot's file keeps of old encounters what tells who met whom and what came of it, and stays sound and small."""

from dataclasses import replace
from pathlib import Path

import pytest

from crcolony.protocol.encounters import EncounterRecord
from crcolony.storage import compaction
from crcolony.storage.reading import read_stored_robot
from crcolony.storage.store import RobotStore
from tests.support.robot_stores import answered, decision, events, mate, open_store, robot


@pytest.fixture(autouse=True)
def _few_full_encounters(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compaction, "FULL_ENCOUNTERS", 3)


def mate_and_end(store: RobotStore, number: int) -> EncounterRecord:
    """Write an encounter that ends as a mating; return its record."""
    record = replace(mate(store, number), state="mated")
    store.write([record])
    return record


def save(store: RobotStore, number: int) -> None:
    store.save(robot(number), events(number), number)


def test_old_encounters_keep_who_met_whom_and_what_came_of_it(tmp_path: Path) -> None:
    """Genotypes and the signed message go; agents, energy and outcome stay, as do the last encounters as a whole."""
    store = open_store(tmp_path / "robot.sqlite")
    records = [mate_and_end(store, number) for number in range(1, 9)]
    save(store, 1)
    save(store, 2)
    matings = read_stored_robot(store.path).matings
    assert [record for record, _ in matings[-3:]] == records[-3:]
    assert [choice for _, choice in matings[-3:]] == [decision(number) for number in (6, 7, 8)]
    for number, (record, choice) in enumerate(matings[:-3], 1):
        full = records[number - 1]
        assert record.partner is not None
        assert full.partner is not None
        assert (record.own.genes, record.partner.genes, record.proof) == (b"", b"", b"")
        assert (record.own.agent, record.partner.agent) == (full.own.agent, full.partner.agent)
        assert choice == replace(decision(number), child=b"", stream=b"")
    store.close()
    open_store(store.path).close()  # and it is sound


def test_what_a_robot_would_go_on_from_is_not_touched(tmp_path: Path) -> None:
    """Decisions after the older snapshot stay whole until a later snapshot has them, too."""
    store = open_store(tmp_path / "robot.sqlite")
    for number in range(1, 9):
        mate_and_end(store, number)
    save(store, 1)
    assert all(record.proof for record, _ in read_stored_robot(store.path).matings)
    for number in range(9, 13):
        mate_and_end(store, number)
    save(store, 2)
    proofs = [bool(record.proof) for record, _ in read_stored_robot(store.path).matings]
    assert proofs == [False] * 8 + [True] * 4
    store.close()


def test_an_encounter_that_is_open_keeps_everything(tmp_path: Path) -> None:
    """However old it is: its partner may come back. Later ones are compacted, also after a restart."""
    store = open_store(tmp_path / "robot.sqlite")
    waiting = answered(1)
    store.write([waiting])
    for number in range(2, 7):
        mate_and_end(store, number)
    save(store, 1)
    save(store, 2)
    store.close()
    store = open_store(store.path)
    for number in range(7, 10):
        mate_and_end(store, number)
    save(store, 3)
    save(store, 4)
    assert store.open_records() == [waiting]
    proofs = [bool(record.proof) for record, _ in read_stored_robot(store.path).matings]
    assert proofs == [True] + [False] * 5 + [True] * 3
    store.close()


def test_a_file_grows_by_a_few_hundred_bytes_an_encounter(tmp_path: Path) -> None:
    """With genotypes and messages of their real size it would be 2,000."""
    store = open_store(tmp_path / "robot.sqlite")
    sizes = []
    for number in range(1, 801):
        record = mate(store, number)
        partner = replace(record, own=replace(record.own, genes=bytes(368)), proof=bytes(560))
        store.write([replace(partner, state="mated")])
        if number % 50 == 0:
            save(store, number)
        if number in (400, 800):
            (pages,) = store._connection.execute("PRAGMA page_count").fetchone()
            (free,) = store._connection.execute("PRAGMA freelist_count").fetchone()
            sizes.append(4096 * (pages - free))
    assert (sizes[1] - sizes[0]) / 400 < 500
    store.close()
