"""One process that has imported all that a robot needs and has opened nothing: it forks robots when it is asked to.

A launch starts it as `python -m crcolony.fork_server DESCRIPTOR`, with a socket (`runtime/forked_process.py`). What it
forks has its own session, streams and memory, of which pages that nobody writes to are shared. It is a child of the
launch, not of this process, which may be gone when it ends; it runs a command line and ends as a new interpreter does.
"""

import gc
import json
import os
import socket
import sys

import llvmlite.binding  # type: ignore[import-untyped]  # noqa: F401

import crcolony.runtime.service_notify
import crcolony.runtime.start_arena
import crcolony.runtime.start_robot  # noqa: F401
from crcolony.cli import main, make_parser
from crcolony.errors import EXIT_OK
from crcolony.runtime.process_title import show_command
from crcolony.runtime.warm_up import load_step_if_compiled
from crcolony.shutdown import ENDS_WITH_PARENT

EXIT_UNSAFE = 1
"""A library has started a thread, which a fork would break."""
_MAX_REQUEST_BYTES = 2**16


def run(channel: socket.socket) -> int:
    """Fork what is asked for, and in a process that was forked run its command line; return the exit code of either."""
    parser = make_parser()
    load_step_if_compiled()
    if len(os.listdir("/proc/self/task")) > 1:
        return EXIT_UNSAFE
    show_command(["crcolony", "fork server"])
    gc.freeze()  # a collection would write into every object, and make the pages of all a robot's own
    words = _serve(channel)
    return EXIT_OK if words is None else main(words, parser)


def _serve(channel: socket.socket) -> list[str] | None:
    """Fork a process for every request; return None when there are no more, and in a process its command line.

    A request is a command line in JSON, with two descriptors: the process's standard input, and its output. The reply
    is the process's id; 0 if it could not be forked. It begins when it can read a byte.
    """
    while True:
        request, descriptors, _, _ = socket.recv_fds(channel, _MAX_REQUEST_BYTES, 2)
        if not request:
            return None
        pid = _fork()
        if pid is None:
            channel.close()
            words: list[str] = json.loads(request)
            _begin(words, *descriptors)
            return words
        for descriptor in descriptors:
            os.close(descriptor)
        channel.send(b"%d" % pid)


def _fork() -> int | None:
    """Fork a process that is not a child of this one; return its id, 0 if that is impossible, and None in the process.

    It gets another parent when the one between the two has exited: the launch, which has asked the system for that.
    """
    reader, writer = os.pipe()
    between = os.fork()
    if between == 0:
        try:
            pid = os.fork()
        except OSError:
            os._exit(1)
        if pid == 0:
            os.close(reader)
            os.close(writer)
            return None
        os.write(writer, b"%d" % pid)
        os._exit(0)
    os.close(writer)
    os.waitpid(between, 0)
    with open(reader, "rb") as id_of_process:
        return int(id_of_process.read() or 0)


def _begin(words: list[str], standard_input: int, output: int) -> None:
    """Become the process of a command line, once the launch knows of it; without a launch, exit."""
    os.setsid()
    for target, source in enumerate((standard_input, output, output)):
        os.dup2(source, target)
    os.close(standard_input)
    os.close(output)
    if not os.read(0, 1):
        os._exit(EXIT_OK)
    os.environ[ENDS_WITH_PARENT] = "1"
    show_command(["crcolony", *words])


if __name__ == "__main__":
    sys.exit(run(socket.socket(fileno=int(sys.argv[1]))))
