"""The socket through which a robot and the process of its body on one machine find each other (Linux).

Its address is in the abstract namespace, so that nothing is left of it, however a process ends. Only processes of one
user speak to each other: the kernel says who is at the other end.
"""

import contextlib
import os
import socket
import struct
import sys

from crcolony.body.shared_pages import LAYOUT

HAS_LOCAL_LINKS = sys.platform == "linux"
"""Whether robot and body can share memory on this system"""

PAGE_NUMBER = struct.Struct("<I")
"""Behind the proof of the body's process: which page of its memory is the robot's"""

_CREDENTIALS = struct.Struct("3i")
"""Process, user and group at the other end"""
_MAX_WAITING = 128
"""Robots that may wait to be accepted."""


def listen_for_robots(arena_run: int) -> socket.socket:
    """Return a socket that listens for robots with bodies in this run of an arena; raises OSError."""
    listening = _socket()
    try:
        listening.bind(_address(arena_run))
        listening.listen(_MAX_WAITING)
    except OSError:
        listening.close()
        raise
    return listening


def connect_to_arena(arena_run: int) -> socket.socket | None:
    """Return a connection to the process of this run of an arena; None if it is not here, or of another user."""
    with contextlib.suppress(OSError):  # a service may not be allowed such sockets either
        connection = _socket()
        try:
            connection.connect(_address(arena_run))
            if is_of_this_user(connection):
                return connection
        except OSError:
            pass
        connection.close()
    return None


def is_of_this_user(connection: socket.socket) -> bool:
    """Return whether the process at the other end is of the same user."""
    size = _CREDENTIALS.size
    data = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, size)
    _, user, _ = _CREDENTIALS.unpack(data)
    return bool(user == os.geteuid())


def _socket() -> socket.socket:
    kind = socket.SOCK_SEQPACKET | socket.SOCK_NONBLOCK | socket.SOCK_CLOEXEC
    return socket.socket(socket.AF_UNIX, kind)


def _address(arena_run: int) -> str:
    return f"\0crcolony/{LAYOUT}/arena/{arena_run}"
