"""Starts robots from one prepared process (`crcolony/fork_server.py`), in a tenth of the time of a new interpreter.

Where that is impossible a process is a new interpreter: on other systems than Linux, or when a library has started a
thread in the prepared process. If the prepared process dies, another one is started with the next robot.
"""

import contextlib
import ctypes
import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Sequence
from typing import BinaryIO, Self

from crcolony.runtime.started_process import StartedProcess, python_command, start_interpreter

_SET_CHILD_SUBREAPER = 36
"""Of prctl(2): what a child of this process has forked becomes a child of this process when that child exits."""
_TIMEOUT_S = 30.0
"""For the first reply, which comes when all is imported."""
_TITLE_BYTES = 512
"""Room for the command lines that `ps` shows of what is forked."""
_ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""A library for matrices starts threads when it is imported, which robots do not need and a fork would break."""


class ForkedProcess:
    """A child of this process that another one has forked."""

    def __init__(self, pid: int, standard_input: int) -> None:
        self.pid = pid
        self.returncode: int | None = None
        self._input = standard_input

    def poll(self) -> int | None:
        """Return the exit code, minus the signal if one has killed it, or None while it runs."""
        return self._wait(os.WNOHANG)

    def send_signal(self, sig: int) -> None:
        """Send it a signal, unless it has ended: another process may have its id then."""
        if self.poll() is None:
            os.kill(self.pid, sig)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        os.close(self._input)
        self._wait(0)

    def _wait(self, options: int) -> int | None:
        if self.returncode is None:
            pid, status = os.waitpid(self.pid, options)
            if pid:
                self.returncode = os.waitstatus_to_exitcode(status)
        return self.returncode


class ForkServer:
    """The prepared process, inside the context; it prepares itself while this process goes on."""

    def __init__(self) -> None:
        self._is_usable = sys.platform == "linux"
        self._has_forked = self._is_adopting = False
        self._server: subprocess.Popen[bytes] | None = None
        self._channel: socket.socket | None = None

    @property
    def pid(self) -> int | None:
        """Its id, if there is one."""
        return self._server.pid if self._server else None

    def __enter__(self) -> Self:
        if self._is_usable:
            _adopt_orphans(True)
            self._start()
            self._is_adopting = True
        return self

    def __exit__(self, *_: object) -> None:
        if self._is_adopting:
            _adopt_orphans(False)
        self._end()

    def start(self, words: Sequence[str], output: BinaryIO) -> StartedProcess:
        """Start a process with a command of crcolony (a `StartProcess`)."""
        if self._is_usable:
            return self._fork(words, output) or start_interpreter(words, output)
        return start_interpreter(words, output)

    def _fork(self, words: Sequence[str], output: BinaryIO) -> ForkedProcess | None:
        """Return a process that was forked, or None if that is impossible."""
        process = self._request(words, output)
        if process is None and self._has_forked:  # it has died since
            process = self._request(words, output)
        self._is_usable = self._has_forked = self._has_forked or process is not None
        return process

    def _request(self, words: Sequence[str], output: BinaryIO) -> ForkedProcess | None:
        """Ask for a process; if there is no reply, end the prepared process and return None."""
        if self._channel is None:
            self._start()
        assert self._channel is not None
        reader, writer = os.pipe()
        pid = 0
        with contextlib.suppress(OSError):
            socket.send_fds(self._channel, [json.dumps(words).encode()], [reader, output.fileno()])
            pid = int(self._channel.recv(32) or 0)
        os.close(reader)
        if not pid:
            os.close(writer)
            self._end()
            return None
        os.write(writer, b"\n")
        return ForkedProcess(pid, writer)

    def _start(self) -> None:
        self._channel, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._channel.settimeout(_TIMEOUT_S)
        with theirs:
            number = theirs.fileno()
            self._server = subprocess.Popen(
                [*python_command("crcolony.fork_server"), str(number), "." * _TITLE_BYTES],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                env=os.environ | _ONE_THREAD,
                pass_fds=[number],
                start_new_session=True,
            )

    def _end(self) -> None:
        if self._server is not None and self._channel is not None:
            self._channel.close()
            self._server.send_signal(signal.SIGKILL)  # it has nothing to save
            self._server.wait()
            self._server = self._channel = None


def _adopt_orphans(is_wanted: bool) -> None:
    """Become the parent of what children of this process have forked, once they exit; or no longer."""
    ctypes.CDLL(None).prctl(_SET_CHILD_SUBREAPER, ctypes.c_ulong(is_wanted))
