"""What the commands of a deployment share: the roles of members, and the address of their authority."""

from importlib.util import find_spec

from crcolony.commands.options import UsageError
from crcolony.errors import CrcolonyError

ROLES = ("robot", "host", "arena", "bridge", "router", "observer", "operator")
"""As in `crcolony.protocol.roster`, which takes longer to import."""

AUTHORITY_PORT = 7448


def check_packages() -> None:
    """Raise CrcolonyError if the package of the extra `deploy` is missing."""
    if find_spec("cryptography") is None:
        raise CrcolonyError(
            "certificates need cryptography, not installed here: pip install 'crcolony[deploy]'"
        )


def host_and_port(text: str) -> tuple[str, int]:
    """Return the parts of HOST:PORT; raises UsageError."""
    if not text:
        raise UsageError(
            f"--at HOST:PORT: where is the authority, as in 10.0.0.5:{AUTHORITY_PORT}?"
        )
    host, colon, port = text.rpartition(":")
    is_port = port.isascii() and port.isdigit() and len(port) <= 5 and int(port) < 65536
    if not (colon and host and is_port):
        raise UsageError(f"--at {text}: expected HOST:PORT, as in 10.0.0.5:{AUTHORITY_PORT}")
    return host.strip("[]"), int(port)
