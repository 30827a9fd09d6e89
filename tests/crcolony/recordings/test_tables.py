"""Rows of tables follow from messages: field by field, in the order of the columns."""

import msgspec
import numpy as np
import pytest

from crcolony.evolution.history import Born
from crcolony.protocol.telemetry_messages import EncounterOutcome, EventMessage, RobotState, Scene
from crcolony.recordings.tables import (
    EVENTS,
    TABLES,
    Row,
    event_row,
    floats_in,
    pack_rows,
    pose_rows,
    state_row,
)
from tests.support.fed_monitor import A_SCENE, ME, PEER, state
from tests.vectors.make import EVENT_MESSAGES


def as_dict(table: str, row: Row) -> dict[str, object]:
    return dict(zip(TABLES[table], row, strict=True))


def test_a_state_is_a_row_with_all_its_fields() -> None:
    """Beside its colony and the time at which it arrived."""
    expected = {"received_unix_ms": 5, "colony": "blue", **msgspec.structs.asdict(state())}
    assert as_dict("states", state_row(state(), "blue", 5)) == {**expected, "robot": ME.hex()}
    assert len(RobotState.__struct_fields__) + 2 == len(TABLES["states"])


@pytest.mark.parametrize("message", EVENT_MESSAGES.values(), ids=str)
def test_an_event_is_a_row_with_its_robot_and_sequence_number(message: EventMessage) -> None:
    """In the table of its kind."""
    row = as_dict(EVENTS[type(message.event)], event_row(message, "blue", 5))
    assert (row["received_unix_ms"], row["colony"]) == (5, "blue")
    assert row["robot"] == message.robot.hex()
    assert (row["incarnation"], row["seq"]) == (message.incarnation, message.seq)
    assert row["tick"] == message.event.tick


def test_an_outcome_without_an_encounter_has_empty_columns_for_it() -> None:
    """As many as an encounter has."""
    event = EncounterOutcome(9, "busy", PEER, None, "")
    row = as_dict("outcomes", event_row(EventMessage(ME, 3, 1, 7, event), "blue", 5))
    assert row["peer"] == PEER.hex()
    assert row["initiator"] is row["responder"] is row["encounter_count"] is None


def test_a_scene_has_a_row_for_every_robot_and_pack() -> None:
    """Packs are numbered."""
    assert isinstance(A_SCENE, Scene)
    poses = [as_dict("poses", row) for row in pose_rows(A_SCENE, 5)]
    packs = [as_dict("packs", row) for row in pack_rows(A_SCENE, 5)]
    assert [row["robot"] for row in poses] == [robot.robot.hex() for robot in A_SCENE.robots]
    assert [row["x_m"] for row in packs] == [pack.x_m for pack in A_SCENE.packs]
    assert [row["pack"] for row in packs] == list(range(len(A_SCENE.packs)))
    assert {row["tick"] for row in poses + packs} == {A_SCENE.tick}


def test_genes_are_float64_values_or_none() -> None:
    """Anyone can publish any bytes."""
    genes = np.array([0.5, -1.0])
    assert floats_in(genes.astype("<f8").tobytes()) == [0.5, -1.0]
    assert floats_in(b"\x00" * 9) is None
    born = Born(0, 0, 0, "x/1", "", b"\x00", None, None)
    row = as_dict("births", event_row(EventMessage(ME, 3, 1, 7, born), "blue", 5))
    assert row["genes"] is None
