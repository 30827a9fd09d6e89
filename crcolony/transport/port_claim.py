"""A claim on a TCP port that another process will listen on in a moment: two launches that start at once choose two."""

import contextlib
import socket
import sys
from collections.abc import Iterator


@contextlib.contextmanager
def claim_port(port: int) -> Iterator[bool]:
    """Claim a port of this machine inside the context; yield whether no other process has claimed it.

    The claim is a name in the same network namespace as the port, which goes with the process. Only Linux has such
    names: elsewhere every claim is granted, and who listens last is told that the port is taken.
    """
    if sys.platform != "linux":
        yield True
        return
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as claim:
        try:
            claim.bind(f"\0crcolony-port-{port}")
        except OSError:
            is_granted = False
        else:
            is_granted = True
        yield is_granted
