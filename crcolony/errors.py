"""The two families of errors that a user meets, and exit codes. Any other exception is a bug and ends with a traceback.

CrcolonyError         something outside the program is wrong: a setting, a file, an endpoint. One line, exit code 2
    ConfigError             a setting                               config
    UsageError              options of a command                    commands.options
    IdentityError           a key, or a list of robots              protocol.identity
    NetworkError            an endpoint, or the network             transport.interface
    NetworkUnavailableError a network that may be there later       transport.interface
    OpenFilesError          a process may open too few files        transport.open_files
    DuplicateIdentityError  another robot has the same key          nodes.embodied_robot
    StorageError            a robot's file                          storage.sql
    BackupError             a backup                                storage.backup_manifest
    StorageFullError        no room for a robot's file              storage.store
    FolderError             a results folder                        storage.files
    EarlierRunError         the run that others begin with          results.earlier_run
    TelemetryError          recorded telemetry                      recordings.telemetry_file
    PastRunError            the folder of a finished run            recordings.past_run
    HistoryDiffersError     a re-simulation                         recordings.resimulation
    ExportError             an export to Parquet                    recordings.export
    ExperimentError         what is asked of an experiment          experiments.catalogue
    WorkerError             a worker of a sweep                     experiments.worker_processes
    TaskGraphError          a task graph of MAXQ                    learning.maxq.task_graph
    ClusterError            a Dask cluster, or an MPI run           experiments.worker_pool
    PlotError               figures                                 results.plots.conditions
    DashboardError          the dashboard                           crcolony_dashboards
    AuditError              the audit log                           crcolony_deploy.audit_log
    MetricsError            where metrics are served                crcolony_deploy.metrics_server
    DeviceError             an attached robot                       crcolony_bridge
    DeployError             an inventory, or what it names          crcolony_deploy
FatalStorageError     it is unknown what is on the disk: the process ends, and starts again from there. Exit code 3
"""

from collections.abc import Iterable

EXIT_OK = 0
"""The command did what it should; 1 is left for bugs, as Python has it."""
EXIT_PROBLEMS = 1
"""`doctor` has found a problem: as with other programs that look for differences."""
EXIT_WRONG_INPUT = 2
"""A CrcolonyError, or options that cannot be parsed."""
EXIT_FATAL = 3
"""A FatalStorageError."""
EXIT_VIOLATED = 4
"""`simulate` found that a promise was not kept, or `audit` that a log was changed."""
EXIT_NOT_CONFIRMED = 5
"""`estop` has no confirmation of some robot."""
EXIT_INTERRUPTED = 130
"""Ctrl-C, as shells have it."""
EXIT_UNREAD = 141
"""The reader of the output is gone, as shells have it."""


class CrcolonyError(Exception):
    """Something outside the program is wrong: the message says in one line what, where, and why."""


class FatalStorageError(Exception):
    """It is unknown whether a transaction is on the disk: the process must end and start again from there."""


def did_you_mean(word: str, known: Iterable[str], least: float = 0.6) -> str:
    """Return "; did you mean …?" with the known word that is most like a wrong one, or "" if none is.

    `least` is the likeness from which on a word is proposed, from 0 to 1.
    """
    from difflib import get_close_matches  # where a mistake is made, not whenever a command starts

    near = get_close_matches(word, list(known), n=1, cutoff=least)
    return f"; did you mean {near[0]}?" if near else ""
