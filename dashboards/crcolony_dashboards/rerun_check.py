"""What a dashboard needs of this machine: Rerun in the right version, and free ports."""

import os
import socket
from importlib.metadata import PackageNotFoundError, version

from crcolony.errors import CrcolonyError

WANTED = (0, 41)
"""The version of Rerun that this is written for; every minor one changes something"""


class DashboardError(CrcolonyError):
    """The dashboard cannot be shown: the message says why."""


def check_rerun() -> None:
    """Raise DashboardError unless Rerun is here in the version that is wanted."""
    wanted = ".".join(map(str, WANTED))
    try:
        found = version("rerun-sdk")
    except PackageNotFoundError:
        raise DashboardError(
            "the dashboard needs Rerun, which is not installed: pip install 'crcolony[viz]'"
        ) from None
    if tuple(map(int, found.split(".")[:2])) != WANTED:
        raise DashboardError(
            f"the dashboard needs Rerun {wanted}, but {found} is installed: pip install 'crcolony[viz]'"
        )
    os.environ.setdefault("RUST_LOG", "off")  # what goes wrong in there is said here, in words
    try:
        import rerun
    except ImportError as error:
        raise DashboardError(f"Rerun {found} does not load: {error}") from None
    assert rerun.__version__


def check_port(port: int, option: str) -> None:
    """Raise DashboardError if a port of this machine is taken, naming the option that chooses another."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", port))
        except OSError as error:
            raise DashboardError(
                f"127.0.0.1:{port}: {(error.strerror or str(error)).lower()};"
                f" choose another with {option}"
            ) from None
