"""A lineage is that of the history, in the columns of the ALife data standard."""

import csv
from pathlib import Path

import pytest

from crcolony.evolution.history import Born, Died, Event, Lived, Mated
from crcolony.recordings.lineage import lineage_of, write_lineage
from crcolony.recordings.past_run import PastRunError, read_history
from tests.support.run_folders import run
from tests.support.small_colony import small


def born(tick: int, agent: str, mother: str | None = None, father: str | None = None) -> Born:
    return Born(tick, 0, tick, agent, "00", b"", mother, father)


def test_a_worked_example_has_two_parents_one_or_none() -> None:
    """Ids count births; times are those of birth and of the end of the generation, `inf` for who lives."""
    events: list[Event] = [
        born(0, "a"),
        born(0, "b"),
        Mated(3, 0, 1, "a", "b", 1.0, 1.0, True, True),
        Died(4, 0, "b"),
        Lived(5, 0, 0, "a", 5, 0.5, 2, 1),
        born(5, "c", "a", "b"),
        born(5, "d", "a"),
        born(5, "e", "someone of an earlier run", "b"),
        born(6, "f", "c", "c"),
    ]
    rows = lineage_of(events)
    assert [(row["id"], row["ancestor_list"]) for row in rows] == [
        (0, "[none]"),
        (1, "[none]"),
        (2, "[0,1]"),
        (3, "[0]"),
        (4, "[1]"),
        (5, "[2]"),
    ]
    assert [row["destruction_time"] for row in rows] == [5, "inf", "inf", "inf", "inf", "inf"]
    assert [row["origin_time"] for row in rows] == [0, 0, 5, 5, 5, 6]
    assert (rows[0]["matings"], rows[0]["captures"], rows[0]["mean_energy"]) == (1, 2, 0.5)
    assert rows[1]["starved_time"] == 4


def test_a_run_has_every_agent_after_its_parents(tmp_path: Path) -> None:
    """Whose names in the history are those of its mother and father."""
    run(tmp_path / "run", small())
    path = write_lineage(tmp_path / "run" / "history.sqlite", tmp_path / "new" / "out")
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    births = [
        event for event in read_history(tmp_path / "run" / "history.sqlite") if type(event) is Born
    ]
    assert [row["agent"] for row in rows] == [birth.agent for birth in births]
    for row, birth in zip(rows, births, strict=True):
        listed = row["ancestor_list"].strip("[]").split(",")
        parents = [rows[int(one)]["agent"] for one in listed if one != "none"]
        assert parents == [name for name in (birth.mother, birth.father) if name is not None]
        assert all(int(one) < int(row["id"]) for one in listed if one != "none")
        assert float(row["destruction_time"]) > float(row["origin_time"])
    assert any("," in row["ancestor_list"] for row in rows)


def test_what_cannot_be_read_or_written_is_named(tmp_path: Path) -> None:
    """One line each."""
    with pytest.raises(PastRunError, match=r"history\.sqlite: missing"):
        write_lineage(tmp_path / "history.sqlite", tmp_path)
    run(tmp_path / "run", small("generations=1"))
    (tmp_path / "file").touch()
    with pytest.raises(PastRunError, match=r"file.*: cannot be written"):
        write_lineage(tmp_path / "run" / "history.sqlite", tmp_path / "file")
