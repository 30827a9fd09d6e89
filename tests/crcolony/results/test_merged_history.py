"""The files of robots, merged, are the history of the colony that they lived in."""

from pathlib import Path

import pytest

from crcolony.evolution.history import Mated
from crcolony.results.merged_history import agent_by_number, merge_robot_files
from crcolony.storage.sql import StorageError
from tests.support.small_colony import Recorder, live, new_colony
from tests.support.stored_colony import id_of, write_robots


@pytest.fixture(scope="module")
def recorder() -> Recorder:
    """Return the history of a small in-process colony."""
    colony, recorder = new_colony()
    colony.start()
    live(colony)
    return recorder


def test_merged_files_have_the_history_of_the_in_process_colony(
    recorder: Recorder, tmp_path: Path
) -> None:
    """The same events in the same order, with the same hash, in whatever order the files are given."""
    paths = write_robots(tmp_path, recorder.events, 4)
    merged = merge_robot_files(paths[::-1])
    assert merged.robots == tuple(map(id_of, range(4)))
    assert list(merged.events) == recorder.events
    assert str(merged.hash) == str(recorder.hash)
    assert merged.one_sided == ()


def test_a_mating_without_the_partners_file_is_one_sided(
    recorder: Recorder, tmp_path: Path
) -> None:
    """It is not an event of the history, and the other matings are."""
    paths = write_robots(tmp_path, recorder.events, 4)
    merged = merge_robot_files(paths[:3])
    matings = recorder.all(Mated)
    whole = [mated for mated in matings if 3 not in (mated.robot, mated.partner_robot)]
    assert [event for event in merged.events if isinstance(event, Mated)] == whole
    assert len(merged.one_sided) == len(matings) - len(whole) > 0
    assert {side.record.peer for side in merged.one_sided} == {id_of(3)}


def test_files_of_the_former_name_are_merged(recorder: Recorder, tmp_path: Path) -> None:
    """They are found by the present name."""
    paths = write_robots(tmp_path, recorder.events, 4)
    paths[1].rename(paths[1].with_name("memory.sqlite"))
    assert list(merge_robot_files(paths).events) == recorder.events


def test_a_damaged_file_is_named(recorder: Recorder, tmp_path: Path) -> None:
    """Nothing is merged then."""
    paths = write_robots(tmp_path, recorder.events, 4)
    paths[2].write_text("no database " * 100)
    with pytest.raises(StorageError, match=f"{paths[2]}: not a crcolony robot file"):
        merge_robot_files(paths)


def test_an_agent_of_an_unknown_robot_keeps_its_name() -> None:
    """Others are named by the number of their robot."""
    numbers = {"ab": 3}
    assert agent_by_number("ab/7", numbers) == "3/7"
    assert agent_by_number("cd/7", numbers) == "cd/7"
