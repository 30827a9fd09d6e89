"""What a process's one loop waits for: that something is in its inbox, or that a file of it has something to read."""

import contextlib
import os
import select
import weakref
from queue import Empty, SimpleQueue

_MAX_READY = 64
"""Files that one wait returns; the others are returned by the next."""


class LinuxWakeup:
    """An epoll, and an eventfd that rings it: a loop can sleep until it is rung, or a file that it watches is ready."""

    def __init__(self) -> None:
        self._bell = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        weakref.finalize(self, os.close, self._bell)
        self._epoll = select.epoll()
        self.watch(self._bell, is_bell=True)

    def ring(self) -> None:
        """End the wait, or the next one if nobody waits; from any thread, and also in a signal handler."""
        os.eventfd_write(self._bell, 1)

    def wait(self, timeout_s: float) -> list[int]:
        """Wait until it is rung, a watched file is ready, or the timeout; return the descriptors of what was ready."""
        return [descriptor for descriptor, _ in self._epoll.poll(timeout_s, _MAX_READY)]

    def watch(self, descriptor: int, is_bell: bool) -> None:
        """Return from `wait` as long as there is something to read, or, of an eventfd, once whenever it is rung.

        That eventfd need not be read then, which saves a call of the system.
        """
        self._epoll.register(descriptor, select.EPOLLIN | (select.EPOLLET if is_bell else 0))

    def forget(self, descriptor: int) -> None:
        """Watch a file no more; it must still be open."""
        self._epoll.unregister(descriptor)


class QueueWakeup:
    """The same for systems without epoll: a queue that holds nothing but rings. It watches no files."""

    def __init__(self) -> None:
        self._rings: SimpleQueue[None] = SimpleQueue()

    def ring(self) -> None:
        """End the wait, or the next one if nobody waits; from any thread, and also in a signal handler."""
        if self._rings.empty():
            self._rings.put(None)

    def wait(self, timeout_s: float) -> list[int]:
        """Wait until it is rung, or the timeout; return nothing."""
        with contextlib.suppress(Empty):
            self._rings.get(block=timeout_s > 0.0, timeout=timeout_s or None)
        return []

    def watch(self, descriptor: int, is_bell: bool) -> None:
        """Raise OSError: there are no files here."""
        raise OSError("this system has no epoll")

    def forget(self, descriptor: int) -> None:
        """See `watch`."""
        raise OSError("this system has no epoll")
