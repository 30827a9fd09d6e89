"""Standard output and standard error that break no run, whatever is behind them: a full disk, a closed pipe, ASCII.

A run is worth more than its output. If the reader of a pipe is gone, as in `crcolony evolve | head`, the command ends
as on SIGTERM, with everything saved. If it cannot be written for another reason the command goes on without it.
"""

import codecs
import contextlib
import io
import os
import select
import signal
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TextIO

if TYPE_CHECKING:
    from rich.console import Console

_IN_ASCII = {
    **dict(zip("▁▂▃▄▅▆▇█", "_.-:=+*#", strict=True)),
    **dict(zip(("░", "…", "×", "←", "→", "±"), (".", ".", "x", "<-", "->", "+-"), strict=True)),
}
"""What is printed where the output cannot hold a character; others are printed as `\\u03b1`."""


def plain_console() -> "Console":
    """Return a console that prints every text as it is: paths may hold brackets, colons and anything else."""
    from rich.console import Console

    return Console(markup=False, highlight=False, emoji=False)


def one_line(text: str) -> str:
    """Return a text whose line breaks and control characters are escaped."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


@dataclass
class StandardStreams:
    """What became of the output of a command."""

    output: "_Output | None" = None

    @property
    def error(self) -> OSError | None:
        """Why standard output could not be written, if it could not."""
        return self.output.error if self.output else None


@contextlib.contextmanager
def standard_streams() -> Iterator[StandardStreams]:
    """Replace the process's standard streams, inside the context, by ones to which writing never fails.

    Streams that were replaced already, as a test or a notebook does, are left as they are.
    """
    _open_closed_descriptors()
    codecs.register_error("crcolony", _replace_unencodable)
    streams = StandardStreams()
    stdout, stderr = sys.stdout, sys.stderr
    if stdout is sys.__stdout__:
        streams.output = _Output(1, ends_process=True)
        sys.stdout = _text_stream(streams.output, stdout)
    if stderr is sys.__stderr__:
        sys.stderr = _text_stream(_Output(2, ends_process=False), stderr)
    try:
        yield streams
    finally:
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(BrokenPipeError):
                stream.flush()
        sys.stdout, sys.stderr = stdout, stderr


class _Output(io.RawIOBase):
    """A descriptor to which writing never fails: after an error, everything is discarded."""

    def __init__(self, descriptor: int, ends_process: bool) -> None:
        self._descriptor = descriptor
        self._ends_process = ends_process
        self.error: OSError | None = None

    def write(self, data: Any, /) -> int:
        while self.error is None:
            try:
                return os.write(self._descriptor, data)
            except BlockingIOError:  # another process has made our terminal non-blocking
                select.select([], [self._descriptor], [])
            except OSError as error:
                self.error = error
                if isinstance(error, BrokenPipeError) and self._ends_process:
                    _end_process(error)
        return len(data)

    def writable(self) -> bool:
        return True

    def fileno(self) -> int:
        return self._descriptor

    def isatty(self) -> bool:
        return os.isatty(self._descriptor)


def _end_process(error: BrokenPipeError) -> None:
    """End a process that saves on SIGTERM as if it got one; raise the error in one that has nothing to save."""
    if not callable(signal.getsignal(signal.SIGTERM)):
        raise error
    signal.raise_signal(signal.SIGTERM)


def _text_stream(output: _Output, former: TextIO | None) -> TextIO:
    return io.TextIOWrapper(
        io.BufferedWriter(output),
        encoding=former.encoding if former else "utf-8",
        errors="crcolony",
        line_buffering=output.isatty() or not output._ends_process,
    )


def _replace_unencodable(error: UnicodeError) -> tuple[bytes, int]:
    """Return a text in ASCII, with the bytes of file names that are no text as they are (a handler of codecs)."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return b"".join(map(_in_ascii, error.object[error.start : error.end])), error.end


def _in_ascii(character: str) -> bytes:
    if "\udc80" <= character <= "\udcff":
        return character.encode("ascii", "surrogateescape")
    return _IN_ASCII.get(character, character).encode("ascii", "backslashreplace")


def _open_closed_descriptors() -> None:
    """Open standard descriptors that are closed, so that no file of a run gets their numbers."""
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
