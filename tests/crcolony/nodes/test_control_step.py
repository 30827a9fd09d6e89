"""Observations of a body on the same machine are answered in a short loop, and a robot cannot tell by which way."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import nan
from pathlib import Path

import numpy as np
import pytest

from crcolony.body import contract
from crcolony.compiled import FloatArray
from crcolony.protocol.body_messages import Contact
from crcolony.robot.state import DIED, MET, SLICE_OVER
from crcolony.transport.interface import ArenaOffline
from tests.support.lone_robot import ARENA_RUN, PEER, LoneRobot
from tests.support.page_link import PageLink
from tests.support.small_robots import empty_observation, random_observation

PERIOD_S = 0.01


@dataclass
class Local:
    """A robot whose body, in lockstep, is on its machine."""

    lone: LoneRobot
    link: PageLink
    tick: int = 0
    now_s: float = 0.0
    rounds: int = 0
    """How often the short loop was left"""

    def observe(self, row: FloatArray, contact: Contact | None = None) -> None:
        """Write the observation of the next tick."""
        self.tick += 1
        self.now_s += PERIOD_S
        self.link.rows.write_observation(self.tick, row, contact)

    def deliver(self) -> None:
        """Let the robot handle the latest observation by the long way."""
        observation = self.link.rows.read_observation()
        assert observation is not None
        self.lone.robot.handle_event(self.now_s, observation)

    def answer_by_the_long_way(self, rows: list[FloatArray]) -> None:
        """Let it handle observations as a process without the short loop does."""
        for row in rows:
            self.observe(row)
            self.deliver()

    def answer_quietly(self, rows: list[FloatArray]) -> None:
        """Let it answer observations as its process does: in the short loop, whenever that is possible."""
        waiting = iter(rows)
        is_over = False

        def wait() -> float | None:
            nonlocal is_over
            row = next(waiting, None)
            if row is None:
                is_over = True
                return None
            self.observe(row)
            return self.now_s

        while not is_over:
            assert self.lone.robot.can_answer_quietly
            self.rounds += 1
            if not self.lone.robot.answer_quietly(wait):
                self.deliver()

    @property
    def state(self) -> dict[str, object]:
        """All of the robot that shows."""
        node = self.lone.node
        return {
            "batch": [np.asarray(field).tobytes() for field in self.lone.batch],
            "tick": node.tick,
            "period": node.period_ms,
            "observed": self.lone.robot.observed_s,
            "generation": node.robot.generation,
            "subpopulation": repr(node.robot.subpopulation.save()),
            "action": self.link.acted,
            "rings": self.link.rings,
            "events": [(topic, data) for topic, data in self.lone.transport.telemetry],
            "lines": self.lone.lines,
        }


@pytest.fixture
def pair(tmp_path: Path) -> Iterator[tuple[Local, Local]]:
    """The same robot twice, with a body in lockstep."""
    made = []
    for name in ("one", "other"):
        folder = tmp_path / name
        folder.mkdir()
        link = PageLink()
        local = Local(LoneRobot(folder, link), link)
        local.lone.grant_body(0.0, lockstep=True)
        local.answer_by_the_long_way([empty_observation()])
        made.append(local)
    yield made[0], made[1]
    for local in made:
        local.lone.store.close()


@pytest.fixture
def local(pair: tuple[Local, Local]) -> Local:
    return pair[0]


def test_the_short_loop_is_the_long_way(pair: tuple[Local, Local]) -> None:
    """Over hundreds of observations, with charges, deaths, hand-overs and turnovers, at every moment of interest."""
    long, short = pair
    rng = np.random.default_rng(5)
    for count in [1, 2, 3, *rng.integers(1, 60, 60).tolist()]:
        rows = [random_observation(rng) for _ in range(count)]
        long.answer_by_the_long_way(rows)
        short.answer_quietly(rows)
        assert long.state == short.state
    assert short.tick > 1500
    assert short.lone.node.robot.generation > 0
    assert short.rounds < short.tick / 3, "most are answered in the loop"


def test_quiet_observations_do_not_leave_the_loop(local: Local) -> None:
    """A hundred of them are one call; each is answered on the page, with one ring."""
    local.answer_quietly([empty_observation() for _ in range(100)])
    assert local.rounds == 1
    assert local.link.acted[0] == local.tick == local.lone.node.tick == 101
    assert local.link.rings == 101
    assert not local.lone.transport.actions, "nothing goes over the network"


@pytest.mark.parametrize("event", [DIED, SLICE_OVER])
def test_an_event_takes_the_whole_way(local: Local, event: int) -> None:
    """What follows from it is done before the action is announced, and the loop is left."""
    lone = local.lone
    lone.batch.slice_steps_left[0] = 2 if event == SLICE_OVER else 100
    agent, turns = lone.node.robot.agent, lone.node.robot.subpopulation.turns.sum()
    local.answer_quietly([empty_observation()])
    if event == DIED:
        lone.batch.energies[:] = 1e-9
    events = len(lone.events)
    local.answer_quietly([empty_observation()])
    assert lone.node.robot.events & event
    assert local.link.acted[0] == local.tick
    if event == DIED:
        assert len(lone.events) == events + 1
    else:
        assert lone.node.robot.subpopulation.turns.sum() == turns + 1, f"agent {agent} hands over"


def test_a_contact_takes_the_whole_way(local: Local) -> None:
    """The robot meets its partner, and does not act until that is settled; nor is it asked meanwhile."""
    lone = local.lone
    contact = Contact(PEER.id, 77)
    row = empty_observation()
    row[contract.ENCOUNTER], row[contract.ENCOUNTER_ROBOT] = 1.0, 3.0
    steps, acted = lone.node.robot.steps, local.link.acted
    waits = iter([True])

    def wait() -> float | None:
        if next(waits, None) is None:
            return None
        local.observe(row, contact)
        return local.now_s

    assert not lone.robot.answer_quietly(wait)
    assert lone.node.robot.steps == steps, "it has made no step yet"
    local.deliver()
    assert lone.node.robot.steps == steps + 1
    assert not lone.node.is_settled
    assert local.link.acted == acted
    assert not lone.robot.can_answer_quietly
    lone.robot.handle_timers(local.now_s + 100.0)  # the partner never answers
    assert lone.node.is_settled
    assert local.link.acted[0] == local.tick
    assert lone.robot.can_answer_quietly


def test_a_mating_that_is_open_keeps_it_from_the_loop(local: Local) -> None:
    """Also one that begins when the last observation has been answered: the next action waits for it."""
    lone = local.lone
    lone.batch.events[0] = MET
    lone.node.handle_step_events(local.now_s, local.tick, Contact(PEER.id, 77))
    assert not lone.robot.can_answer_quietly
    acted = local.link.acted
    local.answer_by_the_long_way([empty_observation()])
    assert local.link.acted == acted


def test_malformed_observations_take_the_whole_way_and_are_refused(local: Local) -> None:
    """They are counted there, and cause no action."""
    row = empty_observation()
    row[contract.GYRO] = nan
    steps, acted = local.lone.node.robot.steps, local.link.acted
    local.answer_quietly([row])
    assert local.lone.node.robot.steps == steps
    assert local.link.acted == acted
    assert local.lone.node.telemetry.faults["refused observation"] == 1


def test_an_observation_that_is_published_again_is_answered_again(local: Local) -> None:
    """With the same action and without another step: the arena has not seen it."""
    local.answer_quietly([empty_observation()])
    steps, acted, rings = local.lone.node.robot.steps, local.link.acted, local.link.rings
    waits = iter([local.now_s])
    assert not local.lone.robot.answer_quietly(lambda: next(waits, None))
    local.deliver()
    assert (local.lone.node.robot.steps, local.link.acted) == (steps, acted)
    assert local.link.rings == rings + 1


def test_an_observation_that_was_missed_is_not_waited_for(local: Local) -> None:
    """The next one leaves the loop, and is answered by the long way."""
    local.answer_quietly([empty_observation()])
    local.tick += 5
    local.answer_quietly([empty_observation()])
    assert local.link.acted[0] == local.lone.node.tick == local.tick


def test_there_is_no_short_loop_without_a_body_on_this_machine(local: Local) -> None:
    """Nor without a body, nor in real time."""
    robot = local.lone.robot
    assert robot.can_answer_quietly
    local.link.is_open = False
    assert not robot.can_answer_quietly
    local.link.is_open = True
    robot.handle_event(1.0, ArenaOffline(ARENA_RUN))
    assert not robot.can_answer_quietly
    local.lone.grant_body(2.0, lockstep=False, arena_run=ARENA_RUN + 1)
    assert not robot.can_answer_quietly


def test_after_the_loop_the_network_goes_on(local: Local) -> None:
    """When memory is shared no more, the next observation is answered there."""
    local.answer_quietly([empty_observation() for _ in range(3)])
    local.link.is_open = False
    local.lone.observe(1.0, local.tick + 1)
    assert local.lone.acted == [local.tick + 1]
