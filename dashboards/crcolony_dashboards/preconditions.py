"""What a dashboard needs on this machine: Rerun in the required version, and free ports."""

import os
import socket
from importlib.metadata import PackageNotFoundError, version

from crcolony.errors import CrcolonyError

REQUIRED_RERUN = (0, 41)
"""Major and minor version; every minor version changes the interface"""


class DashboardError(CrcolonyError):
    """The dashboard cannot be shown; the message says why."""


def check_rerun() -> None:
    """Raise DashboardError unless Rerun is installed in the required version and can be imported."""
    required = ".".join(map(str, REQUIRED_RERUN))
    try:
        found = version("rerun-sdk")
    except PackageNotFoundError:
        raise DashboardError(
            "the dashboard needs Rerun, which is not installed: pip install 'crcolony[viz]'"
        ) from None
    if tuple(map(int, found.split(".")[:2])) != REQUIRED_RERUN:
        raise DashboardError(
            f"the dashboard needs Rerun {required}, but {found} is installed: pip install 'crcolony[viz]'"
        )
    os.environ.setdefault("RUST_LOG", "off")  # Rerun's failures are reported by this program
    try:
        import rerun
    except ImportError as error:
        raise DashboardError(f"Rerun {found} does not load: {error}") from None
    assert rerun.__version__


def check_port_is_free(port: int, option: str) -> None:
    """Raise DashboardError if a port of this machine is taken, naming the option that chooses another one."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", port))
        except OSError as error:
            raise DashboardError(
                f"127.0.0.1:{port}: {(error.strerror or str(error)).lower()};"
                f" choose another with {option}"
            ) from None
