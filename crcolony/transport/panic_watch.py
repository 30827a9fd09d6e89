"""Notices that a thread of Zenoh has panicked: nothing else says so, and its process looks alive.

When routers join and leave, a receiving thread of another router may panic (seen with Zenoh 1.10, of the kind of
eclipse-zenoh/zenoh#2624). Its link stays up, and whatever arrives there is never read again. The only trace is the
message on standard error. So that goes through a pipe.
"""

import contextlib
import os
import re
import threading

_PANIC = re.compile(rb"thread '[^']*' .*panicked at ")
_STDERR = 2
_MAX_LINE_BYTES = 65_536


class PanicWatch:
    """Passes on what this process writes to standard error, and looks for panics in it, inside the context."""

    def __enter__(self) -> "PanicWatch":
        self._has_panicked = threading.Event()
        self._stderr = os.dup(_STDERR)
        reading, writing = os.pipe()
        os.dup2(writing, _STDERR)
        os.close(writing)
        self._thread = threading.Thread(
            target=self._pass_on, args=(reading,), name="standard error", daemon=True
        )
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        os.dup2(self._stderr, _STDERR)  # closes the last end for writing, so that the thread ends
        self._thread.join()
        os.close(self._stderr)

    def take(self) -> bool:
        """Return whether a thread has panicked since this was last asked."""
        if not self._has_panicked.is_set():  # what is set from here on stays for the next time
            return False
        self._has_panicked.clear()
        return True

    def _pass_on(self, reading: int) -> None:
        line = b""
        with open(reading, "rb", buffering=0) as pipe:
            while data := pipe.read(4096):
                with contextlib.suppress(OSError):  # nobody reads it any more
                    os.write(self._stderr, data)
                *lines, line = (line[-_MAX_LINE_BYTES:] + data).split(b"\n")
                if any(_PANIC.match(whole) for whole in lines):
                    self._has_panicked.set()
