"""Drives the real `Mating` of two or three robots through every order of events and looks for a broken promise.

One state of the exploration is: every robot (its `Mating`, its disk, what its body told it), every letter that was ever
said, and how many faults have happened. A step is one of

    a robot hears any letter that was ever said to it      so loss, delay, reordering, duplication and replay of genuine
                                                           letters have no bound: a lost letter is one never heard
    a robot hears a forged letter                          with its sender's key, but not its signature
    a body reports a contact                               to each side by itself, perhaps to one only
    a robot reminds, gives up, or loses patience           at any time, any number of times
    a robot is told that another is gone or back           at any time, rightly or not
    a robot crashes and starts again (a new life)          between any two effects, up to a bound
    a disk refuses a write                                 up to a bound
    a body reports a contact that it reported before       up to a bound

The search is breadth-first, so that a counterexample is a shortest one; it is told as steps in words. In every state,
both disks must agree, and with no more faults, reminding each other must leave nothing open (`_settle`).

What is abstracted. Times: every deadline is a step that may come at any moment, so an order of events that real
deadlines forbid is explored too; a contact that expires is one whose partner is gone. A robot is down for no time: what
is said to it meanwhile is heard later or never. A robot carries out the effects of one event without hearing another's
steps in between; that changes nothing, for the others see only what is sent, and a crash may fall between any two
effects. A write is all or nothing, as SQLite promises. Every decision to mate is counted, whether an offspring comes of
it is the robot's own affair. Robots lie about nothing they sign.
"""

import gc
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import get_args

from crcolony.protocol.encounters import EncounterRecord
from tests.support.explored_robot import (
    NAMES,
    Bounds,
    Caller,
    Kind,
    Outcome,
    Violation,
    disagreement,
    named,
)
from tests.support.explored_situations import Situations, bits

State = tuple[int, ...]
"""The node of every robot, the letters ever said, then how many crashes, refusals and repeats there were."""


@dataclass(frozen=True)
class Report:
    """What an exploration found."""

    states: int
    situations: int
    """Of single robots, in which the real `Mating` was driven"""
    matings: int
    """States in which a mating is complete on both disks: proof that the exploration gets anywhere"""
    violation: Violation | None = None
    steps: tuple[str, ...] = ()

    def __str__(self) -> str:
        if self.violation is None:
            return f"{self.states} states, {self.situations} situations of a robot: no violation"
        lines = [f"{k}. {step}" for k, step in enumerate(self.steps, 1)]
        return "\n".join([f"after {len(lines)} steps, {self.violation}", *lines])


def explore(bounds: Bounds, caller: Caller | None = None, only: Kind | None = None) -> Report:
    """Visit every state within bounds, or stop at the first violation (of this kind, if one is named)."""
    ignored = frozenset(get_args(Kind)) - {only, "error"} if only else frozenset()
    return Explorer(bounds, caller or Caller(), ignored).run()


class Explorer:
    """One exploration. What an event does to one robot is worked out once, by the real `Mating`, and remembered."""

    def __init__(self, bounds: Bounds, caller: Caller, ignored: frozenset[Kind]) -> None:
        self._bounds, self._ignored = bounds, ignored
        self._robots = Situations(bounds, caller, ignored)
        self._agreed: set[tuple[int, int]] = set()
        self._settled: dict[State, Violation | None] = {}
        self._settling: list[str] = []

    def run(self) -> Report:
        """Search breadth-first."""
        gc.disable()  # it would visit every state again and again, and find no cycles
        try:
            return self._search()
        finally:
            gc.enable()

    def _search(self) -> Report:
        robots, mates = self._bounds.robots, 0
        first = (*self._robots.start(), self._robots.forged(), 0, 0, 0)
        came_from: dict[State, tuple[State, Outcome] | None] = {first: None}
        queue = deque([first])
        while queue:
            state = queue.popleft()
            violation = self._check(state[:robots])
            if violation is not None:
                return self._report(came_from, state, violation, mates, self._settling)
            mates += self._is_mated(state[:robots])
            for after, outcome in self._successors(state):
                if outcome.violation is not None:
                    return self._report(came_from, state, outcome.violation, mates, [outcome.words])
                if after not in came_from:
                    came_from[after] = (state, outcome)
                    queue.append(after)
        return Report(len(came_from), len(self._robots.nodes), mates)

    def _successors(self, state: State) -> list[tuple[State, Outcome]]:
        robots, bounds = self._bounds.robots, self._bounds
        said, crashes, refusals, repeats = state[robots:]
        found = []
        for robot in range(robots):
            for outcome in self._robots.moves(state[robot], said & self._robots.to[robot]):
                used = (
                    crashes + outcome.crashes,
                    refusals + outcome.refusals,
                    repeats + outcome.repeats,
                )
                if (
                    used[0] > bounds.crashes
                    or used[1] > bounds.refusals
                    or used[2] > bounds.repeats
                ):
                    continue
                after = (
                    *state[:robot], outcome.node, *state[robot + 1 : robots],
                    said | outcome.said, *used,
                )  # fmt: skip
                found.append((after, outcome))
        return found

    def _report(
        self,
        came_from: dict[State, tuple[State, Outcome] | None],
        last: State,
        violation: Violation,
        matings: int,
        then: Sequence[str],
    ) -> Report:
        steps = list(reversed(then))
        step = came_from[last]
        while step is not None:
            state, outcome = step
            steps.append(outcome.words)
            step = came_from[state]
        return Report(
            len(came_from), len(self._robots.nodes), matings, violation, tuple(reversed(steps))
        )

    # What must hold between robots -------------------------------------------------------------------------------

    def _check(self, nodes: State) -> Violation | None:
        """Check that all disks agree, and that they will once faults end."""
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
        """No more faults: robots remind each other and hear each other, in turn, until nothing is open."""
        now = list(nodes)
        for patience in range(6):
            for robot in range(len(now)):
                for record in self._robots.nodes[now[robot]].mating.open:
                    violation = self._exchange(now, robot, record, patience > 2)
                    if violation:
                        return violation
            if not any(self._robots.nodes[n].mating.open for n in now):
                return self._one_sided(now)
        left = next(r for n in now for r in self._robots.nodes[n].mating.open)
        text = f"{named(left.encounter)} stays {left.state} at its {left.role} without any fault"
        return None if "left open" in self._ignored else Violation("left open", text)

    def _exchange(
        self, now: list[int], robot: int, record: EncounterRecord, is_time_up: bool
    ) -> Violation | None:
        """One robot reminds of an encounter (or gives a proposal up), and all that is then said is heard."""
        mating = self._robots.nodes[now[robot]].mating
        if record.encounter not in (r.encounter for r in mating.open):
            return None
        gives_up = is_time_up and record.state == "proposed"
        verb, label = ("gives", " up") if gives_up else ("reminds of", "")
        words = f"{NAMES[mating.me]} {verb} {named(record.encounter)}{label}"
        outcome = next(o for o in self._robots.spontaneous(now[robot]) if o.words == words)
        to_hear: deque[int] = deque()
        while True:
            self._settling.append(f"without more faults, {outcome.words}")
            if outcome.violation:
                return outcome.violation
            now[robot] = outcome.node
            to_hear.extend(bits(outcome.said))
            if not to_hear:
                return None
            envelope = to_hear.popleft()
            robot = self._robots.envelopes[envelope].to
            outcome = self._robots.on_event(now[robot], envelope)[0]

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
                    return Violation("one-sided", f"{named(record.encounter)} ends as {states}")
        return None

    def _is_mated(self, nodes: State) -> bool:
        return all(
            any(record.state == "mated" for record in self._robots.nodes[n].disk.records)
            for n in nodes
        )
