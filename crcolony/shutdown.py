"""When a process has to shut down: on a signal, after a given time, or when the process that started it is gone.

The signals are Ctrl-C, SIGTERM, and SIGHUP, which comes when a terminal is closed. Under nohup SIGHUP stays ignored.
"""

import contextlib
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any, Self

ENDS_WITH_PARENT = "CRCOLONY_ENDS_WITH_PARENT"
"""Environment variable of a process whose standard input is a pipe that the process that started it holds open."""
_STANDARD_INPUT = 0
_REPEAT_S = 0.2
"""Time between two interrupts of the same work."""
_CONTEXT_CODE = (contextlib.__file__, __file__)
"""Where an interrupt would leave a context half open or half closed."""
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class ShutdownSignal:
    """Returns, when called, whether to shut down.

    A process makes one before it has anything to save; until then a signal ends it at once. `wake` is called in the
    signal handler, to end a wait. However many signals come, none interrupts what is done outside of `interruptible`.
    It is for the rest of the process, or for a context.
    """

    def __init__(
        self, minutes: float | None = None, wake: Callable[[], None] | None = None
    ) -> None:
        self._deadline_s: float | None = None
        self.end_after(minutes)
        self._requests = 0
        self._is_interruptible = self._is_interrupted = False
        self._wake = wake
        self._earlier = _handlers()
        for number in self._earlier:
            signal.signal(number, self._handle_signal)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Let signals have the effect again that they had before."""
        for number, handler in self._earlier.items():
            signal.signal(number, handler)

    def _handle_signal(self, _number: int, frame: FrameType | None) -> None:
        self._requests += 1
        if self._wake is not None:
            self._wake()
        if self._is_interruptible:
            self._is_interrupted = True
            if frame is None or frame.f_code.co_filename not in _CONTEXT_CODE:
                raise KeyboardInterrupt

    def __call__(self) -> bool:
        if self._deadline_s is not None and time.monotonic() > self._deadline_s:
            return True
        return self._requests > 0

    def end_after(self, minutes: float | None) -> None:
        """Shut down in so many minutes from now; None changes nothing."""
        if minutes is not None:
            self._deadline_s = time.monotonic() + 60.0 * minutes

    @property
    def is_urgent(self) -> bool:
        """Whether signals asked more than once: what may be left undone is left undone."""
        return self._requests > 1

    @contextlib.contextmanager
    def interruptible(self) -> Iterator[None]:
        """A context that a signal ends at once: for what may be left undone, such as figures, or compiling.

        A compiler may lose an interrupt in a callback, so it is repeated; or may fail because of it, which is no error.
        """
        self._is_interrupted = False
        closed = threading.Event()
        insisting = threading.Thread(target=self._insist, args=(closed,), daemon=True)
        insisting.start()
        reports, sys.unraisablehook = sys.unraisablehook, self._report_unraisable
        try:
            self._is_interruptible = True
            yield
        except KeyboardInterrupt:
            pass
        except Exception:
            if not self._is_interrupted:
                raise
        finally:
            self._is_interruptible = False
            sys.unraisablehook = reports
            closed.set()
            insisting.join()

    def _insist(self, closed: threading.Event) -> None:
        """Repeat an interrupt until its context is closed."""
        while not closed.wait(_REPEAT_S):
            if self._is_interrupted:
                os.kill(os.getpid(), signal.SIGTERM)

    def _report_unraisable(self, lost: "sys.UnraisableHookArgs") -> None:
        """Report an error that could not be raised, but not our own interrupt."""
        if lost.exc_type is not KeyboardInterrupt:
            sys.__unraisablehook__(lost)


@contextlib.contextmanager
def interrupted_once() -> Iterator[None]:
    """A context that SIGTERM, or a terminal that is closed, ends as Ctrl-C does: at once, and by what closes it.

    Nothing interrupts that a second time.
    """
    earlier = _handlers()

    def interrupt(_number: int, _frame: FrameType | None) -> None:
        for number in earlier:
            signal.signal(number, signal.SIG_IGN)
        raise KeyboardInterrupt

    for number in earlier:
        signal.signal(number, interrupt)
    try:
        yield
    finally:
        for number, handler in earlier.items():
            signal.signal(number, handler)


def _handlers() -> dict[signal.Signals, Any]:
    """Return the signals that ask to shut down, with what handles each now; without SIGHUP if that is ignored."""
    handlers = {number: signal.getsignal(number) for number in _SIGNALS}
    if handlers[signal.SIGHUP] is signal.SIG_IGN:
        del handlers[signal.SIGHUP]
    return handlers


def end_with_parent() -> None:
    """Send this process SIGTERM as soon as the process that started it is gone, if `ENDS_WITH_PARENT` is set.

    However that ended, the pipe is closed then, even if it ended before this was called.
    """
    if os.environ.pop(ENDS_WITH_PARENT, None) is not None:
        threading.Thread(target=_terminate_at_end_of_input, daemon=True).start()


def _terminate_at_end_of_input() -> None:
    while os.read(_STANDARD_INPUT, 1024):
        pass
    os.kill(os.getpid(), signal.SIGTERM)
