"""The process of an arena, in real time or in lockstep. It simulates bodies and makes no selection.

Real time: a tick at every period of the wall clock, without waiting. Lockstep: a tick as soon as every robot that is
online has acted on the one before.
"""

import time
from collections.abc import Callable

from crcolony.runtime.networked_arena import NetworkedArena
from crcolony.runtime.real_time_loop import run_in_real_time
from crcolony.transport.connection import Connection
from crcolony.transport.inbox import Inbox
from crcolony.transport.interface import InboundEvent

_RETRY_S = 0.5
"""In lockstep the observation of a robot that has not acted is published again after this."""


class ArenaProcess:
    """Runs a `NetworkedArena` by the wall clock or in lockstep."""

    def __init__(self, arena: NetworkedArena, inbox: Inbox, connection: Connection) -> None:
        self._arena, self._inbox, self._connection = arena, inbox, connection

    def run(self, is_stopped: Callable[[], bool], wall_period_s: float | None) -> None:
        """Run until stopped, then save. `wall_period_s` is the time between two ticks; None: lockstep."""
        self._arena.accept_local_robots(self._inbox)
        try:
            if wall_period_s is None:
                self._run_in_lockstep(is_stopped)
            else:
                run_in_real_time(self, self._inbox, wall_period_s, is_stopped)
        finally:
            self._arena.close()
        self._arena.save()

    def handle_event(self, event: InboundEvent) -> None:
        """Handle an inbound event."""
        self._arena.handle_event(event)

    def handle_timers(self, now_s: float) -> None:
        """Do what is due."""
        self._connection.handle_timers(now_s)
        self._arena.handle_timers(now_s)

    def step(self) -> None:
        """Simulate one control period, and publish the observations."""
        node = self._arena.node
        node.step()
        self._arena.publish_tick(node.robots)

    def _run_in_lockstep(self, is_stopped: Callable[[], bool]) -> None:
        node = self._arena.node
        while not is_stopped():
            retry_due_s = time.monotonic() + _RETRY_S
            while not node.is_ready and not is_stopped():
                event = self._inbox.get(_RETRY_S)
                if event is not None:
                    self.handle_event(event)
                now_s = time.monotonic()
                if now_s >= retry_due_s:
                    retry_due_s = now_s + _RETRY_S
                    self._arena.publish_observations(node.waiting_for)
                self.handle_timers(now_s)
            if not is_stopped():
                self.step()
                self.handle_timers(time.monotonic())
