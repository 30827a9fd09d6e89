"""What was heard of a colony as Parquet files, one for every kind of thing, for whatever reads tables.

states                                     how robots were
births, deaths, lives, turnovers           what happened to agents and robots
meetings, matings, outcomes                what happened between robots; each of the two tells its side
faults                                     what went wrong outside
poses, packs                               where everything was, in every scene
"""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from crcolony.errors import CrcolonyError
from crcolony.evolution.history import Born
from crcolony.protocol import key_expressions
from crcolony.protocol.telemetry_messages import RobotState, Scene
from crcolony.recordings.gene_columns import GeneColumns
from crcolony.recordings.parquet import TableFile, table_files
from crcolony.recordings.past_run import read_run
from crcolony.recordings.resimulation import HistoryDiffersError, Windows, from_history
from crcolony.recordings.sources import metadata_samples_of, samples_of
from crcolony.recordings.tables import EVENTS, TABLES, event_row, pack_rows, pose_rows, state_row
from crcolony.telemetry.colony_monitor import ColonyMonitor, TelemetrySample
from crcolony.telemetry.status_changes import EventReceived


class ExportError(CrcolonyError):
    """Tables cannot be written: the message says why."""


def export(
    path: Path,
    out: Path,
    windows: Windows | None = None,
    print_line: Callable[[str], None] = lambda line: None,
) -> list[Path]:
    """Write the tables of a recording or a run (as `samples_of` takes it) into a folder; return the files.

    A run that turns out not to be the same when it is lived again is told from its history; that is said. Raises
    ExportError, and what `samples_of` raises.
    """
    check_pyarrow()
    genes = GeneColumns()
    for about in metadata_samples_of(path):
        genes.learn(about)
    try:
        return write_tables(samples_of(path, windows), genes, out)
    except HistoryDiffersError as error:
        print_line(f"{error}; what is exported is from its history alone, without poses")
        return write_tables(from_history(read_run(path)), genes, out)


def check_pyarrow() -> None:
    """Raise ExportError unless pyarrow is here."""
    try:
        import pyarrow.parquet  # type: ignore[import-untyped]
    except ImportError:
        raise ExportError("export needs pyarrow: pip install 'crcolony[viz]'") from None
    assert pyarrow.parquet


def write_tables(sample: Iterable[TelemetrySample], genes: GeneColumns, out: Path) -> list[Path]:
    """Write what was heard into a folder, all tables or none; return the files. Raises ExportError."""
    births = {**TABLES["births"], **dict.fromkeys(genes.names, "double")}
    try:
        with table_files(out, {**TABLES, "births": births}) as files:
            _fill(files, genes, sample)
    except OSError as error:
        raise ExportError(f"{out}: cannot be written: {error.strerror or error}") from None
    return [out / f"{name}.parquet" for name in TABLES]


def _fill(
    files: Mapping[str, TableFile], genes: GeneColumns, all_heard: Iterable[TelemetrySample]
) -> None:
    """Put all that a watcher believes into its table, once."""
    monitor = ColonyMonitor()
    for sample in all_heard:
        before = _latest(monitor, sample)
        for changes in monitor.handle_sample(sample):
            if isinstance(changes, EventReceived):
                message = changes.message
                row = event_row(message, monitor.robots[message.robot].colony, sample.unix_ms)
                is_birth = isinstance(message.event, Born)
                files[EVENTS[type(message.event)]].add(
                    genes.spread(message, row) if is_birth else row
                )
        latest = _latest(monitor, sample)
        if latest is before:
            continue
        if isinstance(latest, RobotState):
            colony = monitor.robots[latest.robot].colony
            files["states"].add(state_row(latest, colony, sample.unix_ms))
        elif isinstance(latest, Scene):
            files["poses"].add_all(pose_rows(latest, sample.unix_ms))
            files["packs"].add_all(pack_rows(latest, sample.unix_ms))


def _latest(monitor: ColonyMonitor, sample: TelemetrySample) -> RobotState | Scene | None:
    """Return the state or scene that is known of whom this is about."""
    if sample.kind == "state":
        _, robot = key_expressions.parse_robot_topic(sample.key, "state") or ("", b"")
        status = monitor.robots.get(robot)
        return status.state if status is not None else None
    if sample.kind == "scene":
        arena = monitor.arenas.get(key_expressions.parse_arena_topic(sample.key, "scene") or "")
        return arena.scene if arena is not None else None
    return None
