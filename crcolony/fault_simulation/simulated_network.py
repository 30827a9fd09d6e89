"""The network of a simulated colony in virtual time: it loses, duplicates, delays, reorders, partitions and clogs.

Liveliness is Zenoh's: a process holds a token, which appears at each peer that receives the holder's heartbeats, and
goes at each that has received none for a lease. If a process dies and its link is up, the peer notices at once.
"""

import heapq
import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from random import Random
from typing import Protocol

from crcolony.fault_simulation.faults import Faults
from crcolony.protocol.identity import RobotId
from crcolony.transport.interface import (
    ActionReceived,
    EnvelopeReceived,
    InboundEvent,
    JoinReplyReceived,
    QueryReceived,
    TelemetryTopic,
)

Endpoint = bytes
Link = tuple[Endpoint, Endpoint]
"""From one endpoint to the other"""

ARENA: Endpoint = b"arena"

LEASE_S = 1.5
"""A token goes at a peer after this long without a heartbeat."""
HEARTBEAT_S = 0.25
"""Time between two heartbeats."""
DELAY_S = 0.02
"""Mean delay of a message."""
_TAIL_S = 0.6
"""Mean delay of a message that takes far longer."""
_REPLAY_S = 15.0
"""The longest delay of a duplicate."""
_JOIN_TIMEOUT_S = 1.0
_MAX_AT_ONCE = 20_000
"""Actions at one moment of virtual time, beyond which there is no progress."""


class NoProgressError(Exception):
    """Actions repeat without any virtual time passing."""


class Schedule:
    """Virtual time, and the actions that are due in it."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self._due: list[tuple[float, int, Callable[[], None]]] = []
        self._entries = 0

    @property
    def next_s(self) -> float:
        """When the next action is due, infinity if none is."""
        return self._due[0][0] if self._due else math.inf

    def at(self, at_s: float, action: Callable[[], None]) -> None:
        """Run an action at a time, or now if that is past; at the same time, in the order of these calls."""
        self._entries += 1
        heapq.heappush(self._due, (max(at_s, self.now_s), self._entries, action))

    def after(self, delay_s: float, action: Callable[[], None]) -> None:
        """Run an action after a delay."""
        self.at(self.now_s + delay_s, action)

    def run_until(self, end_s: float) -> None:
        """Advance virtual time; raises NoProgressError."""
        at_once = 0
        while self._due and self._due[0][0] <= end_s:
            at_s, _, action = heapq.heappop(self._due)
            at_once = at_once + 1 if at_s == self.now_s else 0
            if at_once > _MAX_AT_ONCE:
                raise NoProgressError(f"at {at_s:.3f} s")
            self.now_s = at_s
            action()
        self.now_s = end_s


class Process(Protocol):
    """What receives the events of an endpoint."""

    is_paused: bool

    def deliver(self, event: InboundEvent) -> None:
        """Handle an inbound event."""
        ...


@dataclass
class _Token:
    holder: Endpoint
    online: InboundEvent
    offline: InboundEvent
    is_held: bool = True
    closes_links: bool = False
    heartbeat_s: dict[Endpoint, float] = field(default_factory=dict)
    """When each peer at which the token has appeared received the holder's last heartbeat"""


class SimulatedNetwork:
    """Carries everything between robots and the arena, with the faults of the seed until `end_faults`."""

    def __init__(
        self,
        schedule: Schedule,
        rng: Random,
        faults: Faults,
        forge: Callable[[bytes], bytes | None],
    ) -> None:
        self.counts: Counter[str] = Counter()
        self.cut: set[Link] = set()
        self.scene_subscribers: set[Endpoint] = set()
        self._clogged: dict[Link, list[tuple[InboundEvent, float]]] = {}
        self._schedule, self._rng, self._faults, self._forge = schedule, rng, faults, forge
        self.is_fault_free = False
        self._processes: dict[Endpoint, Process] = {}
        self._tokens: list[_Token] = []
        schedule.after(HEARTBEAT_S, self._send_heartbeats)

    @property
    def now_s(self) -> float:
        """Virtual time."""
        return self._schedule.now_s

    # Liveliness -------------------------------------------------------------------------------------------------

    def add_process(
        self, endpoint: Endpoint, process: Process, online: InboundEvent, offline: InboundEvent
    ) -> None:
        """Connect a process and declare its token; no other token has appeared at it yet."""
        for token in self._tokens:
            token.heartbeat_s.pop(endpoint, None)
        self._processes[endpoint] = process
        self._tokens.append(_Token(endpoint, online, offline))

    def remove_process(self, endpoint: Endpoint, closes_links: bool) -> None:
        """Disconnect a process; peers notice at once if its links close, and else when the lease expires."""
        self._processes.pop(endpoint, None)
        self.scene_subscribers.discard(endpoint)
        for token in self._tokens:
            if token.holder == endpoint and token.is_held:
                token.is_held, token.closes_links = False, closes_links

    def _send_heartbeats(self) -> None:
        """Deliver heartbeats, and with them the tokens that appear and go."""
        self._schedule.after(HEARTBEAT_S, self._send_heartbeats)
        now_s = self._schedule.now_s
        for token in list(self._tokens):
            for observer, process in list(self._processes.items()):
                if observer == token.holder:
                    continue
                if self._receives_heartbeat(observer, token):
                    if observer not in token.heartbeat_s:
                        process.deliver(token.online)
                    token.heartbeat_s[observer] = now_s
                elif observer in token.heartbeat_s and self._is_offline(observer, token, now_s):
                    del token.heartbeat_s[observer]
                    process.deliver(token.offline)
            if not token.is_held:
                for observer in [o for o in token.heartbeat_s if o not in self._processes]:
                    del token.heartbeat_s[observer]
        self._tokens = [token for token in self._tokens if token.is_held or token.heartbeat_s]

    def _receives_heartbeat(self, observer: Endpoint, token: _Token) -> bool:
        holder = self._processes.get(token.holder)
        is_silent = not token.is_held or holder is None or holder.is_paused
        return not is_silent and self._is_up((token.holder, observer))

    def _is_offline(self, observer: Endpoint, token: _Token, now_s: float) -> bool:
        is_noticed = token.closes_links and self._is_up((token.holder, observer))
        return is_noticed or now_s - token.heartbeat_s[observer] >= LEASE_S

    def _is_up(self, link: Link) -> bool:
        return link not in self.cut and link not in self._clogged

    # Messages -------------------------------------------------------------------------------------------------

    def post(self, link: Link, event: InboundEvent, until_s: float = math.inf) -> None:
        """Send an event, which is dropped if it arrives after `until_s`; a forged envelope may follow."""
        self._post(link, event, until_s)
        if (
            not self.is_fault_free
            and isinstance(event, EnvelopeReceived)
            and self._draw(self._faults.forgery)
        ):
            forged = self._forge(event.envelope)
            if forged is not None:
                self.counts["forgeries"] += 1
                self._post(link, EnvelopeReceived(event.to, forged), until_s)

    def _post(self, link: Link, event: InboundEvent, until_s: float) -> None:
        arrive = partial(self._arrive, link, event, until_s)
        if link in self.cut:
            self.counts["cut off"] += 1
        elif link in self._clogged:
            self._clogged[link].append((event, until_s))
        elif self.is_fault_free:
            self._schedule.after(self._exponential(DELAY_S), arrive)
        else:
            if self._draw(self._faults.loss):
                self.counts["losses"] += 1
            else:
                self._schedule.after(self._delay_s(), arrive)
            if self._draw(self._faults.duplication):
                self.counts["duplicates"] += 1
                is_replay = self._draw(0.3)
                delay_s = self._rng.uniform(0.0, _REPLAY_S) if is_replay else self._delay_s()
                self._schedule.after(delay_s, arrive)

    def _arrive(self, link: Link, event: InboundEvent, until_s: float) -> None:
        process = self._processes.get(link[1])
        if process is None or link in self.cut:
            self.counts["no receiver"] += 1
        elif self._schedule.now_s <= until_s:
            process.deliver(event)

    def _delay_s(self) -> float:
        is_slow = self._draw(self._faults.tail)
        return self._exponential(_TAIL_S if is_slow else DELAY_S)

    def _exponential(self, mean_s: float) -> float:
        return -mean_s * math.log(1.0 - self._rng.random())

    def _draw(self, chance: float) -> bool:
        return chance > 0.0 and self._rng.random() < chance

    # Faults --------------------------------------------------------------------------------------------------

    def clog(self, link: Link) -> None:
        """Hold back all messages of a link."""
        self._clogged.setdefault(link, [])

    def unclog(self, link: Link) -> None:
        """Send all messages that were held back at once."""
        for event, until_s in self._clogged.pop(link, []):
            self._post(link, event, until_s)

    def end_faults(self) -> None:
        """Inject no more faults, heal all links, and deliver what is sent soon."""
        self.is_fault_free = True
        self.cut.clear()
        for link in list(self._clogged):
            self.unclog(link)


class SimulatedTransport:
    """One robot's transport; before every envelope and every telemetry message the process may crash."""

    def __init__(
        self,
        network: SimulatedNetwork,
        robot: RobotId,
        count_operation: Callable[[], None],
        on_published: Callable[[RobotId, str, bytes], None],
    ) -> None:
        self._network, self._robot = network, robot
        self._count_operation, self._on_published = count_operation, on_published

    def send_envelope(self, to: RobotId, envelope: bytes) -> None:
        """Send an envelope."""
        self._count_operation()
        self._on_published(self._robot, "envelope", envelope)
        self._network.post((self._robot, to), EnvelopeReceived(to, envelope))

    def request_body(self, robot: RobotId, request: bytes) -> None:
        """Send the arena a request to join or leave; a reply after the timeout is dropped."""
        until_s = self._network.now_s + _JOIN_TIMEOUT_S

        def reply(data: bytes) -> None:
            self._network.post((ARENA, robot), JoinReplyReceived(robot, data), until_s)

        self._network.post((robot, ARENA), QueryReceived("join", robot, request, reply), until_s)

    def request_arena_metadata(self) -> None:
        """Send nothing: the arena of a simulation has the same settings in every run."""

    def publish_action(self, robot: RobotId, action: bytes) -> None:
        """Publish an action."""
        self._network.post((robot, ARENA), ActionReceived(robot, action))

    def publish_telemetry(self, robot: RobotId, topic: TelemetryTopic, data: bytes) -> None:
        """Publish telemetry, to the checker."""
        self._count_operation()
        self._on_published(robot, topic, data)

    def subscribe_scene(self, is_needed: bool) -> None:
        """Deliver the arena's scenes while they are needed."""
        if is_needed:
            self._network.scene_subscribers.add(self._robot)
        else:
            self._network.scene_subscribers.discard(self._robot)
