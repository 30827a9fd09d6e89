"""The two families of errors that a user meets; anything else is a bug, and crashes loudly.

Refusal         something outside is not as it should be: a setting, a file, an endpoint. One line, exit code 2
  ConfigError, FolderError, PlotError, IdentityError, NetworkError, StorageError, StorageFullError,
      DuplicateIdentityError, UsageError, DashboardError, TelemetryError, PastRunError, ExportError
Broken          nobody knows what is on the disk: the process ends, and begins again from the disk. Exit code 3
  FatalStorageError
"""

EXIT_OK, EXIT_WRONG_INPUT, EXIT_BROKEN, EXIT_VIOLATED = 0, 2, 3, 4
EXIT_INTERRUPTED, EXIT_UNREAD = 130, 141
"""What a process ends with; 1 is a bug, with a traceback"""


class CrcolonyError(Exception):
    """The message names what is wrong, where, and why."""


class Broken(Exception):  # noqa: N818
    """The message names what failed; going on could contradict what is on the disk."""
