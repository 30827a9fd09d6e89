"""The network of a simulated colony, in virtual time: it loses, repeats, delays and reorders, is cut and is clogged.

Presence has Zenoh's meaning: a process holds a token, others see it when they can hear its holder, and it is gone for
those who have not heard it for a lease, each by itself. A process that dies may still say so, if its link is whole.
"""

import heapq
import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from random import Random
from typing import Literal, Protocol

from crcolony.fault_simulation.faults import Faults
from crcolony.protocol.identity import RobotId
from crcolony.transport.interface import (
    ActionReceived,
    EnvelopeReceived,
    InboundEvent,
    JoinReplyReceived,
    QueryReceived,
)

Endpoint = bytes
Link = tuple[Endpoint, Endpoint]
"""From one endpoint to the other"""

ARENA: Endpoint = b"arena"

LEASE_S, SCAN_S = 1.5, 0.25
_DELAY_S, _TAIL_S, _REPLAY_S = 0.02, 0.6, 15.0
_JOIN_TIMEOUT_S = 1.0
_MAX_AT_ONCE = 20_000


class TimeStandsStillError(Exception):
    """Something is done again and again without any time passing."""


class Schedule:
    """Virtual time, and what is due in it."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self._due: list[tuple[float, int, Callable[[], None]]] = []
        self._entries = 0

    def at(self, at_s: float, do: Callable[[], None]) -> None:
        """Do something at a time, or now if that is past; at the same time, in the order of these calls."""
        self._entries += 1
        heapq.heappush(self._due, (max(at_s, self.now_s), self._entries, do))

    def after(self, delay_s: float, do: Callable[[], None]) -> None:
        """Do something a while from now."""
        self.at(self.now_s + delay_s, do)

    def run_until(self, end_s: float) -> None:
        """Let time pass; raises TimeStandsStillError."""
        at_once = 0
        while self._due and self._due[0][0] <= end_s:
            at_s, _, do = heapq.heappop(self._due)
            at_once = at_once + 1 if at_s == self.now_s else 0
            if at_once > _MAX_AT_ONCE:
                raise TimeStandsStillError(f"at {at_s:.3f} s")
            self.now_s = at_s
            do()
        self.now_s = end_s


class Process(Protocol):
    """Whatever is reached at an endpoint."""

    is_paused: bool

    def deliver(self, event: InboundEvent) -> None:
        """Take what has arrived."""
        ...


@dataclass
class _Token:
    holder: Endpoint
    seen: InboundEvent
    gone: InboundEvent
    is_held: bool = True
    says_goodbye: bool = False
    heard_s: dict[Endpoint, float] = field(default_factory=dict)
    """By those who see it: when they heard its holder last"""


class SimulatedNetwork:
    """Carries everything between robots and the arena, as badly as the faults of the seed say, until it is `calm`."""

    def __init__(
        self,
        schedule: Schedule,
        rng: Random,
        faults: Faults,
        forge: Callable[[bytes], bytes | None],
    ) -> None:
        self.counts: Counter[str] = Counter()
        self.cut: set[Link] = set()
        self.searching: set[Endpoint] = set()
        """Who looks at what the arena shows"""
        self._clogged: dict[Link, list[tuple[InboundEvent, float]]] = {}
        self._schedule, self._rng, self._faults, self._forge = schedule, rng, faults, forge
        self.is_calm = False
        """Whether nothing goes wrong any more"""
        self._processes: dict[Endpoint, Process] = {}
        self._tokens: list[_Token] = []
        schedule.after(SCAN_S, self._scan)

    @property
    def now_s(self) -> float:
        """Virtual time."""
        return self._schedule.now_s

    # Who is there ----------------------------------------------------------------------------------------------

    def add_process(
        self, endpoint: Endpoint, process: Process, seen: InboundEvent, gone: InboundEvent
    ) -> None:
        """Let a process be reached and seen; it has seen nobody yet."""
        for token in self._tokens:
            token.heard_s.pop(endpoint, None)
        self._processes[endpoint] = process
        self._tokens.append(_Token(endpoint, seen, gone))

    def remove_process(self, endpoint: Endpoint, says_goodbye: bool) -> None:
        """A process is there no more; without a goodbye its lease must run out."""
        self._processes.pop(endpoint, None)
        self.searching.discard(endpoint)
        for token in self._tokens:
            if token.holder == endpoint and token.is_held:
                token.is_held, token.says_goodbye = False, says_goodbye

    def _scan(self) -> None:
        """Let everybody notice who is there and who is not."""
        self._schedule.after(SCAN_S, self._scan)
        now_s = self._schedule.now_s
        for token in list(self._tokens):
            for observer, process in list(self._processes.items()):
                if observer == token.holder:
                    continue
                if self._hears(observer, token):
                    if observer not in token.heard_s:
                        process.deliver(token.seen)
                    token.heard_s[observer] = now_s
                elif observer in token.heard_s and self._is_over(observer, token, now_s):
                    del token.heard_s[observer]
                    process.deliver(token.gone)
            if not token.is_held:
                for observer in [o for o in token.heard_s if o not in self._processes]:
                    del token.heard_s[observer]
        self._tokens = [token for token in self._tokens if token.is_held or token.heard_s]

    def _hears(self, observer: Endpoint, token: _Token) -> bool:
        holder = self._processes.get(token.holder)
        is_silent = not token.is_held or holder is None or holder.is_paused
        return not is_silent and self._is_whole((token.holder, observer))

    def _is_over(self, observer: Endpoint, token: _Token, now_s: float) -> bool:
        is_told = token.says_goodbye and self._is_whole((token.holder, observer))
        return is_told or now_s - token.heard_s[observer] >= LEASE_S

    def _is_whole(self, link: Link) -> bool:
        return link not in self.cut and link not in self._clogged

    # What is sent ----------------------------------------------------------------------------------------------

    def post(self, link: Link, event: InboundEvent, until_s: float = math.inf) -> None:
        """Send something on its way, which nobody wants after a time; letters may be overtaken by forged ones."""
        self._post(link, event, until_s)
        if (
            not self.is_calm
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
        elif self.is_calm:
            self._schedule.after(self._exponential(_DELAY_S), arrive)
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
            self.counts["nobody there"] += 1
        elif self._schedule.now_s <= until_s:
            process.deliver(event)

    def _delay_s(self) -> float:
        is_slow = self._draw(self._faults.tail)
        return self._exponential(_TAIL_S if is_slow else _DELAY_S)

    def _exponential(self, mean_s: float) -> float:
        return -mean_s * math.log(1.0 - self._rng.random())

    def _draw(self, chance: float) -> bool:
        return chance > 0.0 and self._rng.random() < chance

    # What goes wrong -------------------------------------------------------------------------------------------

    def clog(self, link: Link) -> None:
        """Hold back everything on a link."""
        self._clogged.setdefault(link, [])

    def unclog(self, link: Link) -> None:
        """Let everything that was held back come at once."""
        for event, until_s in self._clogged.pop(link, []):
            self._post(link, event, until_s)

    def calm_down(self) -> None:
        """From now on nothing goes wrong any more, and what was sent arrives soon."""
        self.is_calm = True
        self.cut.clear()
        for link in list(self._clogged):
            self.unclog(link)


class SimulatedTransport:
    """One robot's way out; before every letter and every event told its process may be struck down."""

    def __init__(
        self,
        network: SimulatedNetwork,
        robot: RobotId,
        strike: Callable[[], None],
        overhear: Callable[[RobotId, str, bytes], None],
    ) -> None:
        self._network, self._robot = network, robot
        self._strike, self._overhear = strike, overhear

    def send_envelope(self, to: RobotId, envelope: bytes) -> None:
        """Post a letter."""
        self._strike()
        self._overhear(self._robot, "letter", envelope)
        self._network.post((self._robot, to), EnvelopeReceived(to, envelope))

    def request_body(self, robot: RobotId, request: bytes) -> None:
        """Ask the arena for a body; an answer that comes after the question's time is not heard."""
        until_s = self._network.now_s + _JOIN_TIMEOUT_S

        def answer(data: bytes) -> None:
            self._network.post((ARENA, robot), JoinReplyReceived(robot, data), until_s)

        self._network.post((robot, ARENA), QueryReceived("join", robot, request, answer), until_s)

    def publish_action(self, robot: RobotId, action: bytes) -> None:
        """Command a body."""
        self._network.post((robot, ARENA), ActionReceived(robot, action))

    def publish_telemetry(
        self, robot: RobotId, topic: Literal["state", "event"], data: bytes
    ) -> None:
        """Publish telemetry; here somebody always listens."""
        self._strike()
        self._overhear(robot, topic, data)

    def subscribe_scene(self, is_searching: bool) -> None:
        """Let the arena's scenes come, or not."""
        (self._network.searching.add if is_searching else self._network.searching.discard)(
            self._robot
        )
