"""Drives the real state machines of two or three robots through every order of events and looks for a broken promise.

A state of the exploration is: every robot (its state machine, its disk, the contacts that its body reported), every
envelope that was ever sent, and the number of faults so far. A step is one of

    a robot receives any envelope that was ever sent to it   so loss, delay, reordering, duplication and replay have no
                                                             bound: a lost envelope is one that is never received
    a robot receives a forged envelope                       with its sender's key, but not its signature
    a body reports a contact                                 to each side separately, perhaps to one only
    a robot retries, gives up, or waits for patience_s       at any time, any number of times
    a robot sees another go offline or online                at any time, rightly or not
    a robot crashes and restarts (a new incarnation)         between any two effects, up to a bound
    a write fails                                            up to a bound
    a body reports a contact that it reported before         up to a bound
    a robot is backed up, and restored from that copy        where bounds allow it: once copied, at any time

The search is breadth-first, so that a counterexample is a shortest one; it is printed step by step. In every state,
the disks must agree, and without more faults, retries must leave nothing open (`_settle`).

What is abstracted. Times: every timeout is a step that may happen at any moment, so orders of events that real
timeouts forbid are explored too; a contact expires when its partner goes offline. A restart takes no time: what is sent
meanwhile is received later or never. The effects of one event are carried out without a step of another robot in
between; that changes nothing, since other robots see only what is sent, and a crash may happen between any two effects.
A write is all or nothing, as SQLite guarantees. Every decision to mate is counted; whether it leads to an offspring is
not explored. Robots sign no false statements.
"""

import gc
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import get_args

from crcolony.protocol.encounters import EncounterRecord
from tests.support.explored_envelopes import bits
from tests.support.explored_robot import (
    NAMES,
    Bounds,
    Caller,
    Kind,
    Step,
    Violation,
    disagreement,
    format_encounter,
)
from tests.support.explored_situations import Situations

State = tuple[int, ...]
"""The node of every robot, the envelopes ever sent, then the numbers of crashes, failed writes and repeats."""


@dataclass(frozen=True)
class Report:
    """The result of an exploration."""

    states: int
    situations: int
    """Situations of single robots in which the real state machine was driven"""
    matings: int
    """States in which a mating is complete on all disks: it shows that the exploration reaches its end"""
    violation: Violation | None = None
    steps: tuple[str, ...] = ()

    def __str__(self) -> str:
        if self.violation is None:
            return f"{self.states} states, {self.situations} situations of a robot: no violation"
        lines = [f"{k}. {step}" for k, step in enumerate(self.steps, 1)]
        return "\n".join([f"after {len(lines)} steps, {self.violation}", *lines])


def explore(
    bounds: Bounds,
    caller: Caller | None = None,
    only: Kind | None = None,
    ignored: frozenset[Kind] = frozenset(),
) -> Report:
    """Visit every state within bounds, or stop at the first violation (of this kind, if one is named)."""
    if only:
        ignored = frozenset(get_args(Kind)) - {only, "error"}
    return Explorer(bounds, caller or Caller(), ignored).run()


class Explorer:
    """One exploration. The step of an event at one robot is computed once by the real state machine and cached."""

    def __init__(self, bounds: Bounds, caller: Caller, ignored: frozenset[Kind]) -> None:
        self._bounds, self._ignored = bounds, ignored
        self._robots = Situations(bounds, caller, ignored)
        self._agreed: set[tuple[int, int]] = set()
        self._settled: dict[State, Violation | None] = {}
        self._settling: list[str] = []

    def run(self) -> Report:
        """Search breadth-first."""
        gc.disable()  # it would traverse all states many times, and there are no cycles
        try:
            return self._search()
        finally:
            gc.enable()

    def _search(self) -> Report:
        robots, mates = self._bounds.robots, 0
        first = (
            *self._robots.start(),
            self._robots.envelopes.send_forged(self._bounds.contacts),
            0,
            0,
            0,
        )
        came_from: dict[State, tuple[State, Step] | None] = {first: None}
        queue = deque([first])
        while queue:
            state = queue.popleft()
            violation = self._check(state[:robots])
            if violation is not None:
                return self._report(came_from, state, violation, mates, self._settling)
            mates += self._is_mated(state[:robots])
            for after, step in self._successors(state):
                if step.violation is not None:
                    return self._report(came_from, state, step.violation, mates, [step.text])
                if after not in came_from:
                    came_from[after] = (state, step)
                    queue.append(after)
        return Report(len(came_from), len(self._robots.nodes), mates)

    def _successors(self, state: State) -> list[tuple[State, Step]]:
        robots, bounds = self._bounds.robots, self._bounds
        sent, crashes, failed_writes, repeats = state[robots:]
        found = []
        for robot in range(robots):
            for step in self._robots.moves(state[robot], sent & self._robots.envelopes.to[robot]):
                used = (
                    crashes + step.crashes,
                    failed_writes + step.failed_writes,
                    repeats + step.repeats,
                )
                if (
                    used[0] > bounds.crashes
                    or used[1] > bounds.failed_writes
                    or used[2] > bounds.repeats
                ):
                    continue
                after = (
                    *state[:robot], step.node, *state[robot + 1 : robots],
                    sent | step.sent, *used,
                )  # fmt: skip
                found.append((after, step))
        return found

    def _report(
        self,
        came_from: dict[State, tuple[State, Step] | None],
        last: State,
        violation: Violation,
        matings: int,
        then: Sequence[str],
    ) -> Report:
        steps = list(reversed(then))
        previous = came_from[last]
        while previous is not None:
            state, step = previous
            steps.append(step.text)
            previous = came_from[state]
        return Report(
            len(came_from), len(self._robots.nodes), matings, violation, tuple(reversed(steps))
        )

    # What must hold between robots -------------------------------------------------------------------------------

    def _check(self, nodes: State) -> Violation | None:
        """Check that all disks agree, and that they do without more faults."""
        if nodes not in self._settled:
            self._settling = []
            self._settled[nodes] = self._disagreement(nodes) or self._settle(nodes)
        return self._settled[nodes]

    def _disagreement(self, nodes: State) -> Violation | None:
        for one in nodes:
            for other in nodes:
                if one == other or (one, other) in self._agreed:
                    continue
                violation = disagreement(self._robots.nodes[one], self._robots.nodes[other])
                if violation and violation.kind not in self._ignored:
                    return violation
                self._agreed.add((one, other))
        return None

    def _settle(self, nodes: State) -> Violation | None:
        """Check that without more faults the robots' retries leave nothing open, and the same on all disks."""
        now = list(nodes)
        for rounds in range(6):
            for robot in range(len(now)):
                for record in self._robots.nodes[now[robot]].mating.open:
                    violation = self._deliver_retry(now, robot, record, rounds > 2)
                    if violation:
                        return violation
            if not any(self._robots.nodes[n].mating.open for n in now):
                return self._one_sided(now)
        left = next(r for n in now for r in self._robots.nodes[n].mating.open)
        text = f"{format_encounter(left.encounter)} stays {left.state} at its {left.role} without any fault"
        return None if "left open" in self._ignored else Violation("left open", text)

    def _deliver_retry(
        self, now: list[int], robot: int, record: EncounterRecord, is_time_up: bool
    ) -> Violation | None:
        """Let a robot retry an encounter (or give up a proposal), and deliver all that is sent then."""
        mating = self._robots.nodes[now[robot]].mating
        if record.encounter not in (r.encounter for r in mating.open):
            return None
        gives_up = is_time_up and record.state == "proposed"
        verb = "gives up" if gives_up else "retries"
        text = f"{NAMES[mating.me]} {verb} {format_encounter(record.encounter)}"
        step = next(o for o in self._robots.spontaneous(now[robot]) if o.text == text)
        to_deliver: deque[int] = deque()
        while True:
            self._settling.append(f"without more faults, {step.text}")
            if step.violation:
                return step.violation
            now[robot] = step.node
            to_deliver.extend(bits(step.sent))
            if not to_deliver:
                return None
            envelope = to_deliver.popleft()
            robot = self._robots.envelopes[envelope].to
            step = self._robots.receive(now[robot], envelope)[0]

    def _one_sided(self, now: list[int]) -> Violation | None:
        for number in now:
            node = self._robots.nodes[number]
            for record in node.disk.records:
                peer = next(
                    p
                    for p in map(self._robots.nodes.__getitem__, now)
                    if p.mating.me == record.peer
                )
                states = {record.state, peer.disk.state_of(record.encounter)}
                if "mated" in states and len(states) > 1 and "one-sided" not in self._ignored:
                    return Violation(
                        "one-sided", f"{format_encounter(record.encounter)} ends as {states}"
                    )
        return None

    def _is_mated(self, nodes: State) -> bool:
        return all(
            any(record.state == "mated" for record in self._robots.nodes[n].disk.records)
            for n in nodes
        )
