"""No peer can crash a robot, stall its control loop, keep it from mating, or grow its memory: an attack for each test.

Four robots live in real time and mate several times a second. In calm whiles all of their encounters become matings;
nearly all must under attack, too, and no later. The bounds leave room for a noisy machine, and for how little happens
in a few seconds; the real figures are told by `python -m tests.system.report_hostile`.
"""

import statistics
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from crcolony.protocol.telemetry_messages import RobotState
from tests.support.attack import HZ, Figures, Siege, siege
from tests.support.mating_audit import check_ledger
from tests.support.process import wait_until
from tests.support.process_colony import settle

CALM_S, ATTACK_S = 3.0, 6.0
LEAST_MATED = 0.8
"""Of the share of encounters that become matings in calm whiles; the promise is 0.9."""
LATEST = 1.5
"""The 99th percentile of control periods, of a period more than in calm whiles."""
MAX_GROWN_MIB = 40.0


@dataclass
class Besieged:
    """A colony under siege, and what it was like in all calm whiles so far."""

    siege: Siege
    calm: list[Figures] = field(default_factory=list)

    def withstands(self, attack: str) -> tuple[Figures, list[RobotState]]:
        """Let a peer attack; check what holds under any attack; return the figures and what robots told before."""
        before = self.states()
        self.calm.append(self.siege.monitor(CALM_S))
        with self.siege.attacked(attack):
            during = self.siege.monitor(ATTACK_S)
        for process in self.siege.honest:
            assert process.is_running, process.said[-2000:]
        share = statistics.mean(figures.mated_share for figures in self.calm)
        latest = statistics.mean(figures.period_ms[1] for figures in self.calm)
        assert during.mated_share >= LEAST_MATED * share > 0.0, during
        assert during.period_ms[1] <= latest + LATEST * 1000.0 / HZ, during
        assert during.grown_mib <= MAX_GROWN_MIB, during
        return during, before

    def states(self) -> list[RobotState]:
        """Return how the robots are, by their own account."""
        self.siege.view.update()
        return [self.siege.view.states[robot.id] for robot in self.siege.made.robots]

    def refuses(self, attack: str) -> None:
        """Let a peer attack, with letters that robots count as refused."""
        _, before = self.withstands(attack)
        for robot, earlier in zip(self.states(), before, strict=True):
            assert robot.refused > earlier.refused


@pytest.fixture(scope="module")
def besieged(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Besieged]:
    """A colony for all attacks; afterwards its ledger is exact."""
    with siege(tmp_path_factory.mktemp("siege")) as made:
        yield Besieged(made, [made.monitor(CALM_S)])
        settle(made.made, made.view)
        made.made.stop_robots()
        check_ledger(made.made.memories)


def test_letters_too_long_to_be_any_are_not_even_kept(besieged: Besieged) -> None:
    """From one byte too many to megabytes, as letters, observations and questions."""
    besieged.refuses("oversized")


def test_malformed_letters_are_refused(besieged: Besieged) -> None:
    """Noise, and honest letters with bits flipped, cut short or made longer: 500 a second."""
    besieged.refuses("malformed")


def test_genes_that_are_none_are_never_conceived_from(besieged: Besieged) -> None:
    """NaN, infinite, out of range, too many, too few: well signed, with a real nonce, by somebody who was never met."""
    besieged.withstands("unfit")


def test_an_impostor_is_not_believed(besieged: Besieged) -> None:
    """Letters in a robot's name, under another key or with a signature that is not its own, quoting a real contact."""
    besieged.refuses("impostor")


def test_recorded_letters_have_no_effect_when_replayed(besieged: Besieged) -> None:
    """To whom they were said, and to others: no mating is decided twice, as the ledger shows in the end."""
    besieged.withstands("replay")


def test_an_old_contact_is_good_for_nothing(besieged: Besieged) -> None:
    """Proposals that quote the nonce of a contact that is over, or of a contact of others."""
    besieged.withstands("stale")


def test_ten_thousand_letters_a_second_make_no_control_step_late(besieged: Besieged) -> None:
    """Well-signed proposals of two thousand made-up robots, among replays."""
    besieged.withstands("flood")


def test_made_up_robots_that_ask_for_bodies_disturb_nobody(besieged: Besieged) -> None:
    """Two thousand requests a second, half of them noise: everybody keeps its body, and the arena's log stays short."""
    arena, *robots = besieged.siege.honest
    before, lost = len(arena.said), [robot.said.count("is gone") for robot in robots]
    besieged.withstands("joins")
    assert [robot.said.count("is gone") for robot in robots] == lost
    assert len(arena.said) - before < 100_000


def test_observers_that_ask_without_end_are_answered_in_moderation(besieged: Besieged) -> None:
    """A thousand questions a second about all of the past, half of them noise."""
    besieged.withstands("questions")


def test_observations_of_another_world_or_time_are_ignored(besieged: Besieged) -> None:
    """And those that are no numbers, or noise. One of the right world and tick is believed (not promised)."""
    _, before = besieged.withstands("observations")
    for robot, earlier in zip(besieged.states(), before, strict=True):
        assert robot.faults > earlier.faults


def test_an_observation_of_a_tick_to_come_costs_a_robot_seconds_at_most(besieged: Besieged) -> None:
    """It then hears its body no more, asks for it again, and learns what time it is."""
    made, view = besieged.siege.made, besieged.siege.view
    with besieged.siege.attacked("future"):
        wait_until(lambda: besieged.states()[0].tick >= 2**50, "it is believed", 10.0)
        wait_until(lambda: besieged.states()[0].tick < 2**50, "it is forgotten", 15.0)
    settle(made, view)


def test_lies_to_watchers_harm_watchers_at_most(besieged: Besieged, tmp_path: Path) -> None:
    """Robots do not listen to telemetry; and `crcolony status` still tells who is alive."""
    with besieged.siege.attacked("telemetry"):
        made = besieged.siege.made
        status = made.start("status", "status", "--connect", made.endpoint)
        assert status.wait(30.0) == 0
    besieged.withstands("telemetry")
    for robot in besieged.siege.made.robots:
        assert robot.id.hex()[:8] in status.said


def test_a_claim_to_be_a_robot_does_not_end_it(besieged: Besieged) -> None:
    """A liveliness token in a robot's name, of an older life, proves nothing: the robot lives on."""
    besieged.withstands("tokens")
