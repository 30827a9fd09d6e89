"""Tells systemd how a service is: that it is ready, what it does, and that its loop still turns (sd_notify(3)).

systemd restarts a service whose loop has stopped turning (`WatchdogSec=` of its unit). A process that systemd has not
started tells nobody, and pays nothing for it.
"""

import contextlib
import os
import socket
import time
from collections.abc import Callable, Mapping

ADDRESS = "NOTIFY_SOCKET"
"""Environment variable with the address of systemd's socket; "@" begins one without a file."""
WATCHDOG = "WATCHDOG_USEC"
WATCHDOG_PID = "WATCHDOG_PID"
START_EXTENSION_S = 300.0
"""A start that makes progress may take so much longer."""
_FEEDS_IN_TIME = 4
"""The watchdog is fed so many times in the time after which it bites: one late turn of a loop must not matter."""


class ServiceNotifier:
    """Sends messages to systemd; without `send` nobody listens, and every method does nothing."""

    def __init__(
        self, send: Callable[[bytes], None] | None = None, watchdog_s: float | None = None
    ) -> None:
        self._send = send
        self._feed_period_s = None if watchdog_s is None else watchdog_s / _FEEDS_IN_TIME
        self._feed_due_s = self._extension_due_s = 0.0

    def say_ready(self, status: str) -> None:
        """Say that the service has started, and what it is; from now on the watchdog waits for `feed`."""
        self._tell(f"READY=1\nSTATUS={status}\nWATCHDOG=1")

    def say_stopping(self) -> None:
        """Say that the service is about to end."""
        self._tell("STOPPING=1")

    def starting(self, is_stopped: Callable[[], bool]) -> Callable[[], bool]:
        """Return `is_stopped` for a loop that waits for the network: while it turns, the start may take longer."""
        if self._send is None:
            return is_stopped

        def is_stopped_after_extension() -> bool:
            now_s = time.monotonic()
            if now_s >= self._extension_due_s:
                self._extend_start(now_s, "waiting for the network")
            return is_stopped()

        return is_stopped_after_extension

    def reporting(self, print_line: Callable[[str], None]) -> Callable[[str], None]:
        """Return `print_line` for the progress of a start: with every line it may take longer.

        Compiling takes a minute, or ten on a small computer; one that makes no progress ends with the start's timeout.
        """

        def print_and_extend(line: str) -> None:
            print_line(line)
            self._extend_start(time.monotonic(), line)

        return print_and_extend

    def _extend_start(self, now_s: float, status: str) -> None:
        self._extension_due_s = now_s + START_EXTENSION_S / _FEEDS_IN_TIME
        self._tell(f"EXTEND_TIMEOUT_USEC={int(1e6 * START_EXTENSION_S)}\nSTATUS={status}")

    def feed(self, now_s: float) -> None:
        """Say that the loop turns. It may be called at every turn: what is not due yet is not sent."""
        if self._feed_period_s is not None and now_s >= self._feed_due_s:
            self._feed_due_s = now_s + self._feed_period_s
            self._tell("WATCHDOG=1")

    def watching(self, is_stopped: Callable[[], bool]) -> Callable[[], bool]:
        """Return `is_stopped` for a loop that asks it at every turn: each time the watchdog is fed."""
        if self._feed_period_s is None:
            return is_stopped

        def is_stopped_after_feeding() -> bool:
            self.feed(time.monotonic())
            if is_stopped():
                self.say_stopping()
                return True
            return False

        return is_stopped_after_feeding

    def _tell(self, message: str) -> None:
        if self._send is not None:
            self._send(message.encode())


def service_notifier(environment: Mapping[str, str] = os.environ) -> ServiceNotifier:
    """Return what tells systemd about this process, or nobody if systemd has not started it."""
    address = environment.get(ADDRESS, "")
    if not address.startswith(("/", "@")) or not hasattr(socket, "AF_UNIX"):
        return ServiceNotifier()
    target = "\0" + address[1:] if address.startswith("@") else address

    def send(message: bytes) -> None:
        # OSError: systemd is restarted, or its queue is full. Nothing of ours may fail or wait for it.
        with (
            contextlib.suppress(OSError),
            socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as channel,
        ):
            channel.setblocking(False)
            channel.sendto(message, target)

    return ServiceNotifier(send, _watchdog_s(environment))


def _watchdog_s(environment: Mapping[str, str]) -> float | None:
    """Return after how long without a sign systemd ends this process; None: it does not."""
    if environment.get(WATCHDOG_PID, str(os.getpid())) != str(os.getpid()):
        return None
    with contextlib.suppress(ValueError):
        watchdog_us = int(environment.get(WATCHDOG, ""))
        return watchdog_us / 1e6 if watchdog_us > 0 else None
    return None
