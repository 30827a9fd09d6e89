"""Whole colonies live through everything that can go wrong, by seed, and no promise is broken (`simulation.py`).

SIMULATED_SEEDS=20000 makes a night of it; a failure names its seed and the command that repeats it. The second half
breaks the code on purpose, one line each, and shows that the simulation notices.
"""

import os
import subprocess
import sys
from collections import Counter
from random import Random

import pytest

from crcolony.fault_simulation.faults import Faults, draw_faults
from crcolony.fault_simulation.simulate import Report, simulate
from crcolony.nodes import mating_driver
from crcolony.nodes.mating_driver import MatingDriver
from crcolony.nodes.robot_node import RobotNode
from crcolony.protocol.encounters import Effect, EncounterRecord, Send
from crcolony.protocol.mating import MatingStateMachine
from crcolony.protocol.mating_messages import Accept
from crcolony.storage.rows import Decision
from crcolony.storage.store import RobotStore

SEEDS, CHUNK = int(os.environ.get("SIMULATED_SEEDS", "200")), 10

ROUGH = Faults(
    loss=0.15,
    duplication=0.1,
    tail=0.1,
    forgery=0.3,
    crash_operations=40.0,
    kills=True,
    stops=True,
    pauses=True,
    partitions=True,
    clogs=True,
    full_disks=True,
    broken_disks=True,
    clock_jumps=True,
    arena_restarts=True,
)
"""Everything at once"""


class TestPromises:
    """Both mate or neither, at most once, by signed genes, with nothing lost, and nothing open in the end."""

    @pytest.mark.parametrize("first", range(0, SEEDS, CHUNK))
    def test_no_seed_breaks_a_promise(self, first: int) -> None:
        """Ten colonies, each with its own mix of faults, keep every promise, and robots mate in them."""
        reports = [simulate(seed) for seed in range(first, min(first + CHUNK, SEEDS))]
        broken = [str(report) for report in reports if report.violations]
        assert not broken, "\n".join(broken)
        assert sum(report.matings for report in reports) >= 5 * len(reports)

    def test_everything_at_once(self) -> None:
        """With all faults on nothing is broken either, and everything that can become of an encounter is seen."""
        counts: Counter[str] = Counter()
        for seed in range(10):
            report = simulate(seed, faults=ROUGH)
            assert not report.violations, str(report)
            counts += report.counts + Counter(matings=report.matings)
        expected = [
            "aborted", "arena restarts", "busy", "clock jumps", "clogs", "crashes", "cut off",
            "doubt", "duplicates", "expired", "forged", "full disks", "kills", "losses",
            "malformed", "matings", "orphaned", "partitions", "pauses", "refused", "resolved",
            "stops", "storage", "unexpected",
        ]  # fmt: skip
        assert not [name for name in expected if not counts[name]]

    def test_in_peace_every_mating_has_both_sides_at_once(self) -> None:
        """Without faults nobody is ever in doubt, gives up, or waits for a partner that is gone."""
        report = simulate(1, faults=Faults())
        assert not report.violations, str(report)
        assert report.matings > 10
        assert report.conceptions > 10
        assert not {"doubt", "orphaned", "resolved", "storage", "crashes"} & set(+report.counts)

    def test_a_robot_that_is_missed_by_one_alone_comes_anew(self) -> None:
        """Where single links are clogged for seconds, whoever misses a robot that lives comes onto the network anew."""
        reports = [simulate(seed, faults=Faults(clogs=True)) for seed in range(10)]
        assert not [str(report) for report in reports if report.violations]
        assert sum(report.counts["came anew"] for report in reports) > 0

    @pytest.mark.parametrize("robots", [2, 8])
    def test_colonies_of_other_sizes(self, robots: int) -> None:
        """Two robots and eight keep the same promises."""
        for seed in range(3):
            report = simulate(seed, robots, ROUGH)
            assert not report.violations, str(report)


class TestRepeatability:
    def test_a_seed_is_a_colony(self) -> None:
        """The same seed gives the same history and the same words, whatever hashes Python uses; another seed others."""
        code = "from crcolony.fault_simulation.simulate import simulate; print(repr(simulate(3)))"
        runs = {
            subprocess.run(
                [sys.executable, "-c", code],
                env=os.environ | {"PYTHONHASHSEED": number},
                capture_output=True,
                text=True,
                check=True,
            ).stdout.strip()
            for number in ("1", "2")
        }
        report, other = simulate(3), simulate(4)
        assert runs == {repr(report)}
        assert report.log != other.log
        assert report.history != other.history

    def test_a_failure_says_how_to_repeat_it(self) -> None:
        """A report with a violation ends with the command that gives it again; one without has none."""
        failed = Report(7, 3, draw_faults(Random(7)), violations=["a promise"])
        assert str(failed).endswith("crcolony simulate --seeds 1 --seed 7 --robots 3")
        assert "VIOLATION a promise" in str(failed)
        assert "repeat" not in str(Report(7, 3, Faults()))


def assert_caught(words: str, faults: Faults, seeds: int = 10) -> None:
    """Assert that the simulation complains in these words, in at most so many colonies."""
    complaints: list[str] = []
    for seed in range(seeds):
        complaints += simulate(seed, faults=faults).violations
        if any(words in complaint for complaint in complaints):
            return
    pytest.fail(f"not noticed: {complaints}")


STRUCK = Faults(crash_operations=30.0)
"""Processes die between any two things they do."""
FULL = Faults(full_disks=True)


class TestSabotage:
    """Each test breaks one thing and names the complaint."""

    def test_saying_before_writing(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """A robot that says what is not on its disk yet is heard doing so."""
        carry_out = MatingDriver._carry_out

        def say_first(self: MatingDriver, now_s: float, effects: list[Effect]) -> None:
            carry_out(self, now_s, sorted(effects, key=lambda effect: not isinstance(effect, Send)))

        monkeypatch.setattr(MatingDriver, "_carry_out", say_first)
        assert_caught("but on its disk is", Faults())

    def test_forgetting_decisions_that_are_younger_than_the_snapshot(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """A robot that comes back without what it conceived last is noticed."""
        monkeypatch.setattr(RobotStore, "decisions_since", lambda self: [])
        assert_caught("a conception is lost in a restart", STRUCK)

    def test_drawing_the_same_numbers_again(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """A robot that comes back with randomness it has used already is noticed."""
        relive = RobotNode._replay_decision

        def relive_without_stream(
            self: RobotNode, record: EncounterRecord, decision: Decision
        ) -> None:
            stream = self.robot.stream.copy()
            relive(self, record, decision)
            self.robot.stream[...] = stream

        monkeypatch.setattr(RobotNode, "_replay_decision", relive_without_stream)
        assert_caught("would draw the same numbers again", STRUCK)

    def test_believing_letters_of_another_colony(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """A robot that takes genes signed for another colony has genes its partner did not give."""
        monkeypatch.setattr(mating_driver, "has_valid_signature", lambda envelope, colony: True)
        assert_caught("has genes its partner did not give", Faults(forgery=0.5, tail=0.1))

    def test_believing_a_commit_of_another_colony(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """A responder that takes a decision signed for another colony mates alone."""
        monkeypatch.setattr(mating_driver, "has_valid_signature", lambda envelope, colony: True)
        assert_caught("only one of the two mated", Faults(forgery=0.5, tail=0.1, loss=0.2))

    def test_not_undoing_what_a_full_disk_refused(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """A robot that goes on as if its disk had taken a decision is heard claiming it."""
        monkeypatch.setattr(MatingStateMachine, "rollback", lambda self, now_s, write: [])
        assert_caught("but on its disk is", FULL)

    def test_keeping_an_offspring_that_a_full_disk_refused(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """A pool with an offspring that nobody decided about is noticed."""
        monkeypatch.setattr(RobotNode, "rollback_decision", lambda self: None)
        assert_caught("conceptions, ", FULL)

    def test_mating_before_being_on_the_disk(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Newborns who mate though their snapshot found no room: after a crash others are born by their names."""
        never = property(lambda self: False, lambda self, value: None)
        monkeypatch.setattr(RobotNode, "_has_unsaved_births", never, raising=False)
        assert_caught("gives genes of an agent that is not on its disk", FULL)

    def test_forgetting_what_is_open(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """A robot that comes back without its open encounters leaves its partner alone with a mating."""
        monkeypatch.setattr(RobotStore, "open_records", lambda self: [])
        assert_caught("only one of the two mated", STRUCK)

    def test_beginning_the_same_life_twice(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """A robot that does not count its starts is noticed."""
        monkeypatch.setattr(RobotStore, "begin_incarnation", lambda self, unix_s: 5)
        assert_caught("lives 5 twice", STRUCK, seeds=1)

    def test_leaving_a_partner_in_doubt(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """An initiator that does not answer what it has never decided leaves its partner waiting for ever."""
        on_accept = MatingStateMachine._on_accept

        def only_known(
            self: MatingStateMachine,
            now_s: float,
            message: Accept,
            envelope: bytes,
            waiting: "object",
        ) -> list[Effect]:
            if waiting is None:
                return []
            return on_accept(self, now_s, message, envelope, waiting)  # type: ignore[arg-type]

        monkeypatch.setattr(MatingStateMachine, "_on_accept", only_known)
        assert_caught("still prepared at the end", STRUCK)

    def test_an_error_nobody_expected(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """An exception in a robot is a complaint that names the place, and the colony lives on."""

        def fail(self: RobotNode, now_s: float) -> None:
            raise KeyError("sabotage")

        monkeypatch.setattr(RobotNode, "handle_timeouts", fail)
        assert_caught("KeyError at test_simulate.py", Faults(loss=0.3), seeds=3)
