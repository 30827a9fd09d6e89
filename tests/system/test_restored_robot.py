"""A robot whose machine is lost goes on from a backup: what it forgot stays forgotten, and nothing is doubled."""

import shutil
from pathlib import Path

from crcolony.protocol.encounters import EncounterRecord
from crcolony.protocol.mating_messages import Encounter
from crcolony.storage.reading import read_stored_robot
from tests.support.command_line import run_command
from tests.support.process_colony import colony


def records_of(path: Path) -> dict[Encounter, EncounterRecord]:
    """Return the encounters in a robot's file."""
    return {record.encounter: record for record, _ in read_stored_robot(path).matings}


def decided(path: Path) -> list[Encounter]:
    """Return the encounters about whose offspring a robot has decided."""
    return [record.encounter for record, choice in read_stored_robot(path).matings if choice]


def test_a_robot_that_was_lost_goes_on_from_its_backup(tmp_path: Path) -> None:
    """It is copied while it mates, killed after further matings, and restored: no mating is decided twice on any disk.

    What was decided before the copy stays; what it forgot its partners alone know, and it does not happen again; new
    matings follow, of a later incarnation.
    """
    with colony(tmp_path) as made:
        made.arena(3, "--hz", "20")
        lost, *others = (made.robot() for _ in range(3))
        view = made.observer()
        view.wait_for_matings(4, of=lost.id)
        saved = run_command("backup", lost.folder, "--to", tmp_path / "backup.tar.gz")
        assert saved.returncode == 0, saved.stderr
        view.wait_for_matings(4, of=lost.id)
        lost.kill()
        at_loss = records_of(lost.store)
        incarnations = list(view.incarnations[lost.id])
        shutil.rmtree(lost.folder)
        restored = run_command("restore", tmp_path / "backup.tar.gz", "--out", lost.folder)
        assert restored.returncode == 0, restored.stderr
        copied, kept = records_of(lost.store), set(decided(lost.store))
        forgotten = {e for e, record in at_loss.items() if record.state == "mated"} - copied.keys()
        assert kept
        assert forgotten
        lost.start()
        view.wait_for_matings(4, of=lost.id)
        assert view.incarnations[lost.id][-1] > max(incarnations)
        for arena in made.arenas:
            arena.stop()
        made.stop_robots()
        matings = {robot.id: decided(robot.store) for robot in made.robots}
        assert all(len(set(each)) == len(each) for each in matings.values()), "decided twice"
        assert kept < set(matings[lost.id])
        assert not forgotten & set(matings[lost.id]), "what it forgot does not happen again"
        of_others = {encounter for robot in others for encounter in matings[robot.id]}
        assert forgotten <= of_others, "what it forgot its partners know"
