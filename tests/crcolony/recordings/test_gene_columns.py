"""Genes have a column each if the settings of their robot are known, and share one column if not."""

import numpy as np
import pytest

from crcolony.body.settings import CyberRodent
from crcolony.evolution.history import Born
from crcolony.nodes.reported_settings import settings_as_json
from crcolony.protocol.telemetry_messages import (
    MAX_ROBOT_SETTINGS,
    EventMessage,
    RobotMetadata,
)
from crcolony.recordings import gene_columns
from crcolony.recordings.gene_columns import GeneColumns
from crcolony.recordings.tables import TABLES, Row, event_row
from crcolony.robot.genes import agent_schema
from crcolony.robot.settings import Heredity, Learning
from crcolony.telemetry.samples import RobotMetadataSample
from tests.support.fed_monitor import ME, PEER

SETTINGS = settings_as_json(
    {"body": CyberRodent(), "learning": Learning(), "heredity": Heredity()}, MAX_ROBOT_SETTINGS
)
NAMES = [gene.name for gene in agent_schema(Learning(), Heredity()).genes]
GENES = [0.25 * k for k in range(len(NAMES))]
SHARED = tuple(TABLES["births"]).index("genes")


def metadata(settings: str = SETTINGS) -> RobotMetadataSample:
    metadata = RobotMetadata(ME, 3, settings, [], "")
    return RobotMetadataSample(colony="blue", metadata=metadata, unix_ms=7, size_bytes=0)


def birth(robot: bytes = ME, genes: list[float] = GENES) -> EventMessage:
    data = np.array(genes, dtype="<f8").tobytes()
    return EventMessage(robot, 3, 1, 7, Born(0, 0, 0, "x/1", "", data, None, None))


def spread(columns: GeneColumns, message: EventMessage) -> tuple[Row, Row]:
    """Return the row of a birth before and after."""
    row = event_row(message, "blue", 7)
    return row, columns.spread(message, row)


def test_genes_with_names_have_a_column_each() -> None:
    """In the order of the schema, behind the other columns, and the shared column is empty."""
    columns = GeneColumns()
    columns.add_metadata(metadata())
    assert list(columns.names) == NAMES
    before, after = spread(columns, birth())
    assert list(after[len(before) :]) == GENES
    assert after[SHARED] is None
    assert before[:SHARED] == after[:SHARED]


@pytest.mark.parametrize("message", [birth(PEER), birth(genes=GENES[:-1])])
def test_genes_without_names_stay_in_one_column(message: EventMessage) -> None:
    """Those of a robot without known settings, and those that do not fit the settings."""
    columns = GeneColumns()
    columns.add_metadata(metadata())
    before, after = spread(columns, message)
    assert after == (*before, *[None] * len(NAMES))


def test_settings_that_are_invalid_or_have_too_many_genes_add_no_columns(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Anyone can publish any settings."""
    columns = GeneColumns()
    columns.add_metadata(metadata("{}"))
    assert not columns.names
    monkeypatch.setattr(gene_columns, "_MAX_COLUMNS", len(NAMES) - 1)
    columns.add_metadata(metadata())
    assert not columns.names
