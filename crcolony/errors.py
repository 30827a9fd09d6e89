"""The two families of errors that a user meets, and exit codes. Any other exception is a bug and ends with a traceback.

CrcolonyError         something outside the program is wrong: a setting, a file, an endpoint. One line, exit code 2
    ConfigError             a setting                               config
    UsageError              options of a command                    commands.options
    IdentityError           a key, or a list of robots              protocol.identity
    NetworkError            an endpoint, or the network             transport.interface
    DuplicateIdentityError  another robot has the same key          nodes.embodied_robot
    StorageError            a robot's file                          storage.sql
    StorageFullError        no room for a robot's file              storage.store
    FolderError             a results folder                        storage.files
    TelemetryError          recorded telemetry                      recordings.telemetry_file
    PastRunError            the folder of a finished run            recordings.past_run
    HistoryDiffersError     a re-simulation                         recordings.resimulation
    ExportError             an export to Parquet                    recordings.export
    PlotError               figures                                 results.plots.conditions
    DashboardError          the dashboard                           crcolony_dashboards
FatalStorageError     it is unknown what is on the disk: the process ends, and starts again from there. Exit code 3
"""

EXIT_OK = 0
"""The command did what it should; 1 is left for bugs, as Python has it."""
EXIT_WRONG_INPUT = 2
"""A CrcolonyError, or options that cannot be parsed."""
EXIT_FATAL = 3
"""A FatalStorageError."""
EXIT_VIOLATED = 4
"""`simulate` found that a promise was not kept."""
EXIT_INTERRUPTED = 130
"""Ctrl-C, as shells have it."""
EXIT_UNREAD = 141
"""The reader of the output is gone, as shells have it."""


class CrcolonyError(Exception):
    """Something outside the program is wrong: the message says in one line what, where, and why."""


class FatalStorageError(Exception):
    """It is unknown whether a transaction is on the disk: the process must end and start again from there."""
