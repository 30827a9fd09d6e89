"""Records and decisions are written once, each in its place."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from tests.support.robot_stores import OTHER, answered, decision, mate, open_store


def test_a_record_replaces_the_former_one_of_its_encounter(tmp_path: Path) -> None:
    """The decision about offspring stays, and an encounter that has ended is no longer open."""
    path = tmp_path / "robot.sqlite"
    store = open_store(path)
    record = mate(store, 1)
    store.write([answered(2), answered(3, peer=OTHER)])
    assert store.open_records() == [record, answered(2), answered(3, peer=OTHER)]
    over = [replace(record, state="mated"), answered(2, "aborted")]
    store.write(over)
    assert store.open_records() == [answered(3, peer=OTHER)]
    assert store.decisions_since() == [(over[0], decision(1))]
    store.close()


def test_an_encounter_is_decided_once(tmp_path: Path) -> None:
    """A second decision is a bug, and leaves the file as it was; so does a decision without a record."""
    store = open_store(tmp_path / "robot.sqlite")
    record = mate(store, 1)
    wrongs: tuple[Callable[[], None], ...] = (
        lambda: store.write([record], record, decision(2)),
        lambda: store.write([answered(5), record], record, decision(2)),
        lambda: store.write([answered(5)], record, decision(2)),
        lambda: store.write([answered(5)], answered(5)),
        lambda: store.write([answered(5)], answered(5), replace(decision(2), energy=float("nan"))),
    )
    for wrong in wrongs:
        with pytest.raises(ValueError):
            wrong()
    assert store.decisions_since() == [(record, decision(1))]
    assert store.marks() == {}
    store.close()
