"""The loop of a process in real time: a tick at every period of the wall clock, without waiting for answers."""

import time
from collections.abc import Callable
from typing import Protocol

from crcolony.transport.inbox import Inbox
from crcolony.transport.interface import InboundEvent


class TickedProcess(Protocol):
    """A process that makes a step at every tick, and handles events and timers in between."""

    def handle_event(self, event: InboundEvent) -> None:
        """Handle an inbound event."""
        ...

    def handle_timers(self, now_s: float) -> None:
        """Do what is due."""
        ...

    def step(self) -> None:
        """Make one control period pass."""
        ...


def run_in_real_time(
    process: TickedProcess, inbox: Inbox, period_s: float, is_stopped: Callable[[], bool]
) -> None:
    """Run a process until it is stopped, one step every `period_s`."""
    due_s = time.monotonic() + period_s
    while not is_stopped():
        now_s = time.monotonic()
        while now_s < due_s and not is_stopped():
            event = inbox.get(due_s - now_s)
            if event is not None:
                process.handle_event(event)
            now_s = time.monotonic()
        process.step()
        due_s += period_s
        if now_s > due_s:  # the machine was suspended: ticks that were missed are skipped
            due_s = now_s + period_s
        process.handle_timers(now_s)
