"""Exports the telemetry of a run as Parquet files, one a table.

states                                     the states of robots
births, deaths, lives, turnovers           what happened to agents and robots
meetings, matings, outcomes                what happened between robots, as published by each of the two
faults                                     what failed outside
poses, packs                               where robots and battery packs were, in every scene
"""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from crcolony.errors import CrcolonyError
from crcolony.evolution.history import Born
from crcolony.protocol.telemetry_messages import EventMessage
from crcolony.recordings.gene_columns import GeneColumns
from crcolony.recordings.parquet import TableFile, table_files
from crcolony.recordings.past_run import read_run
from crcolony.recordings.resimulation import HistoryDiffersError, Windows, from_history
from crcolony.recordings.sources import metadata_samples_of, samples_of
from crcolony.recordings.tables import (
    EVENTS,
    TABLES,
    Row,
    event_row,
    pack_rows,
    pose_rows,
    state_row,
)
from crcolony.telemetry.colony_monitor import ColonyMonitor
from crcolony.telemetry.samples import (
    RobotMetadataSample,
    SceneSample,
    StateSample,
    TelemetrySample,
)
from crcolony.telemetry.status_changes import EventReceived


class ExportError(CrcolonyError):
    """Tables cannot be written: the message says why."""


def export(
    path: Path,
    out: Path,
    windows: Windows | None = None,
    print_line: Callable[[str], None] = lambda line: None,
) -> list[Path]:
    """Write the tables of a recording or a run (a `path` as for `samples_of`) into a folder; return the files.

    If a re-simulated run has another history than it had, its tables are written from its history, and a line is
    printed. Raises ExportError, and the errors of `samples_of`.
    """
    check_pyarrow()
    genes = GeneColumns()
    for sample in metadata_samples_of(path):
        if isinstance(sample, RobotMetadataSample):
            genes.add_metadata(sample)
    try:
        return write_tables(samples_of(path, windows), genes, out)
    except HistoryDiffersError as error:
        print_line(f"{error}; the tables are from its history alone, without poses")
        return write_tables(from_history(read_run(path)), genes, out)


def check_pyarrow() -> None:
    """Raise ExportError unless pyarrow is installed."""
    try:
        import pyarrow.parquet  # type: ignore[import-untyped]
    except ImportError:
        raise ExportError("export needs pyarrow: pip install 'crcolony[viz]'") from None
    assert pyarrow.parquet


def write_tables(samples: Iterable[TelemetrySample], genes: GeneColumns, out: Path) -> list[Path]:
    """Write samples into a folder, all tables or none; return the files. Raises ExportError."""
    births = {**TABLES["births"], **dict.fromkeys(genes.names, "double")}
    try:
        with table_files(out, {**TABLES, "births": births}) as files:
            _fill(files, genes, samples)
    except OSError as error:
        raise ExportError(f"{out}: cannot be written: {error.strerror or error}") from None
    return [out / f"{name}.parquet" for name in TABLES]


def _fill(
    files: Mapping[str, TableFile], genes: GeneColumns, samples: Iterable[TelemetrySample]
) -> None:
    """Write what a monitor accepts into its table: every event once, no stale states."""
    monitor = ColonyMonitor()
    for sample in samples:
        for change in monitor.handle_sample(sample):
            if isinstance(change, EventReceived):
                message = change.message
                row = event_row(message, monitor.robots[message.robot].colony, sample.unix_ms)
                files[EVENTS[type(message.event)]].add(_with_gene_columns(row, message, genes))
        match sample:
            case StateSample(state=state):
                robot = monitor.robots.get(state.robot)
                if robot is not None and robot.state is state:
                    files["states"].add(state_row(state, robot.colony, sample.unix_ms))
            case SceneSample(scene=scene):
                arena = monitor.arenas.get(scene.arena)
                if arena is not None and arena.scene is scene:
                    files["poses"].add_all(pose_rows(scene, sample.unix_ms))
                    files["packs"].add_all(pack_rows(scene, sample.unix_ms))


def _with_gene_columns(row: Row, message: EventMessage, genes: GeneColumns) -> Row:
    return genes.spread(message, row) if isinstance(message.event, Born) else row
