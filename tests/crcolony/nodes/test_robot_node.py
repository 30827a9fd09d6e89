"""A robot keeps what must survive its process, and counts over all its incarnations."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

from crcolony.evolution.history import Born, Event, TurnedOver
from crcolony.protocol.body_messages import Contact
from crcolony.robot.state import MET
from crcolony.storage.store import StorageFullError
from tests.support.lone_robot import PEER, LoneRobot


def test_captures_are_counted_over_all_generations_and_incarnations(
    lone: LoneRobot, tmp_path: Path
) -> None:
    """Of those that have ended, and of the present one."""

    def captures(robot: LoneRobot) -> int:
        return robot.node.state(0).captures

    lone.set_captures([1, 2, 0, 4])
    assert captures(lone) == 7
    lone.turn_over()
    assert captures(lone) == 7
    lone.set_captures([0, 1, 1, 0])
    assert captures(lone) == 9
    lone.node.save()
    lone.store.close()
    restarted = LoneRobot(tmp_path)
    assert captures(restarted) == 9
    restarted.turn_over()
    assert captures(restarted) == 9
    restarted.store.close()


def test_a_restarted_robot_is_the_one_that_was_saved(lone: LoneRobot, tmp_path: Path) -> None:
    """In its next incarnation, without new births."""
    lone.turn_over()
    ids, generation = lone.node.robot.subpopulation.ids, lone.node.robot.generation
    lone.store.close()
    restarted = LoneRobot(tmp_path)
    assert restarted.node.incarnation == lone.node.incarnation + 1
    assert restarted.node.robot.subpopulation.ids == ids
    assert restarted.node.robot.generation == generation
    assert not restarted.events
    restarted.store.close()


def test_a_turnover_is_recorded_and_saved(lone: LoneRobot) -> None:
    """With the births of the next generation."""
    lone.turn_over()
    assert sum(isinstance(event, TurnedOver) for event in lone.events) == 1
    assert sum(isinstance(event, Born) for event in lone.events) == 8
    stored = lone.store.load()
    assert stored is not None


def test_a_full_disk_is_a_fault_and_keeps_newborn_agents_from_mating(
    lone: LoneRobot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After a crash other agents could be born with their names."""

    def fail(robot: Mapping[str, Any], events: Sequence[Event], tick: int) -> None:
        raise StorageFullError("no room")

    def meet() -> bool:
        lone.batch.events[0] = MET
        before = len(lone.events)
        lone.node.handle_step_events(1.0, 1, Contact(PEER.id, 5))
        return len(lone.events) > before

    assert meet()
    monkeypatch.setattr(lone.store, "save", fail)
    lone.turn_over()
    assert lone.node.telemetry.faults == {"not saved": 1}
    assert not meet()
    monkeypatch.undo()
    assert lone.node.save()
    assert meet()
