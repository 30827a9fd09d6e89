"""What the commands of a deployment share: the roles of members, and the address of their authority."""

from crcolony.commands.options import UsageError

ROLES = ("robot", "host", "arena", "bridge", "router", "observer", "operator")
"""As in `crcolony.protocol.roster`, which takes longer to import."""

AUTHORITY_PORT = 7448


def host_and_port(text: str) -> tuple[str, int]:
    """Return the parts of HOST:PORT; raises UsageError."""
    host, colon, port = text.rpartition(":")
    is_port = port.isascii() and port.isdigit() and len(port) <= 5 and int(port) < 65536
    if not (colon and host and is_port):
        raise UsageError(f"--at {text}: expected HOST:PORT, as in 10.0.0.5:{AUTHORITY_PORT}")
    return host.strip("[]"), int(port)
