"""Processes that share the runs of a sweep: they end soon after a signal, and with the process that started them."""

import contextlib
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from typing import ParamSpec, TypeVar

from crcolony.errors import EXIT_OK, CrcolonyError

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")

_REPEAT_S = 0.1
_SHUTDOWN_TIMEOUT_S = 30.0
"""How long workers may take to save and exit before they are killed."""


class WorkerError(CrcolonyError):
    """A worker was killed from outside."""


class _WorkerProcesses(ProcessPoolExecutor):
    """Processes that Ctrl-C in a terminal, or its end, does not reach: it is for the process that started them."""

    def submit(
        self,
        function: Callable[Parameters, Result],
        /,
        *args: Parameters.args,
        **kwargs: Parameters.kwargs,
    ) -> Future[Result]:
        """Submit a job, for which a process may be started: signals that are blocked now stay blocked in it."""
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGHUP})
        try:
            return super().submit(function, *args, **kwargs)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextlib.contextmanager
def worker_processes(count: int, is_stopped: Callable[[], bool]) -> Iterator[Executor]:
    """Provide so many workers. When the context ends after a stop, or with an error, they save and end at once.

    Raises WorkerError if one is killed from outside.
    """
    os.environ["PYTHONSAFEPATH"] = "1"  # or a user's file, as `queue.py`, would be a module there
    context = multiprocessing.get_context("spawn")
    executor = _WorkerProcesses(count, context, initializer=_prepare_worker)
    is_complete = False
    try:
        yield executor
        is_complete = not is_stopped()
    except BrokenExecutor:
        raise WorkerError("a worker process was killed: out of memory? --resume goes on") from None
    finally:
        executor.shutdown(wait=is_complete, cancel_futures=True)
        started_s = time.monotonic()
        while processes := multiprocessing.active_children():
            is_late = time.monotonic() - started_s > _SHUTDOWN_TIMEOUT_S
            for process in processes:  # again and again: it may have been about to begin a run
                process.kill() if is_late else process.terminate()
            time.sleep(_REPEAT_S)


def ended_at_once(job: Callable[[], Result]) -> Result:
    """Call, in a worker, a job that has nothing to save: SIGTERM ends it with its process, even in compiled code."""
    before = signal.signal(signal.SIGTERM, signal.SIG_DFL)
    try:
        return job()
    finally:
        signal.signal(signal.SIGTERM, before)


def _prepare_worker() -> None:
    """Let SIGTERM end a run, and an orphan, but no other idle worker: it may hold a lock that the others need."""
    signal.signal(signal.SIGTERM, _exit_if_parent_is_gone)
    threading.Thread(target=_terminate_after_parent, daemon=True).start()


def _exit_if_parent_is_gone(*_: object) -> None:
    parent = multiprocessing.parent_process()
    if parent is None or not parent.is_alive():
        os._exit(EXIT_OK)


def _terminate_after_parent() -> None:
    """Wait until the parent is gone, and then send SIGTERM to this process until it ends: a run is saved first."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
    while True:
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(_REPEAT_S)
