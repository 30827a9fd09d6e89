"""A process that a launch has started, however it did, and how it starts a new interpreter."""

import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Protocol

import crcolony
from crcolony.shutdown import ENDS_WITH_PARENT


class StartedProcess(Protocol):
    """What a launch needs of a process; a context at whose end the process has been waited for.

    Its standard input is a pipe that the launch holds open, and on whose end it terminates.
    """

    @property
    def pid(self) -> int: ...

    @property
    def returncode(self) -> int | None: ...

    def poll(self) -> int | None: ...

    def send_signal(self, sig: int) -> None: ...

    def __enter__(self) -> object: ...

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        value: BaseException | None,
        traceback: TracebackType | None,
    ) -> None: ...


StartProcess = Callable[[Sequence[str], BinaryIO], StartedProcess]
"""Starts a process in a session of its own, so that Ctrl-C here does not reach it: a command, and its output."""


def start_program(command: Sequence[str], output: BinaryIO) -> StartedProcess:
    """Start any program."""
    return subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=output,
        stderr=output,
        env={**os.environ, ENDS_WITH_PARENT: "1"},
        start_new_session=True,
    )


def start_interpreter(words: Sequence[str], output: BinaryIO) -> StartedProcess:
    """Start a new interpreter with a command of crcolony."""
    return start_program([*python_command("crcolony"), *words], output)


def python_command(module: str) -> list[str]:
    """Return how to start a module of ours so that no file of a user's in the working folder, as `queue.py`, is one.

    A checkout that is not installed is found through the working folder, where nothing but it should be.
    """
    is_in_working_folder = Path(crcolony.__file__).parents[1] == Path.cwd()
    safe_path = [] if is_in_working_folder else ["-P"]
    return [sys.executable, *safe_path, "-m", module]
