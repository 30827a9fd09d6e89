"""Whole colonies run with every kind of fault, by seed, and no promise is broken.

SIMULATED_SEEDS=20000 runs for a night; a failure names its seed and the command that repeats it. The second half breaks
the code on purpose, one line each, and shows that the simulation reports it.
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
from crcolony.nodes.mating_decision import MatingDecisions
from crcolony.nodes.mating_driver import MatingDriver
from crcolony.nodes.robot_node import RobotNode
from crcolony.protocol.encounters import Effect, EncounterRecord, Send
from crcolony.protocol.mating import MatingStateMachine
from crcolony.protocol.mating_messages import Accept
from crcolony.storage.rows import Decision
from crcolony.storage.store import RobotStore

SEEDS, CHUNK = int(os.environ.get("SIMULATED_SEEDS", "30")), 10

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
"""All kinds of faults at once."""


class TestPromises:
    """Both mate or neither, at most once, with signed genes; no conception is lost, and no encounter stays open."""

    @pytest.mark.slow
    @pytest.mark.parametrize("first", range(0, SEEDS, CHUNK))
    def test_no_seed_breaks_a_promise(self, first: int) -> None:
        """Ten colonies, each with its own mix of faults, keep every promise, and their robots mate."""
        reports = [simulate(seed) for seed in range(first, min(first + CHUNK, SEEDS))]
        broken = [str(report) for report in reports if report.violations]
        assert not broken, "\n".join(broken)
        assert sum(report.matings for report in reports) >= 5 * len(reports)

    def test_all_kinds_of_faults_at_once(self) -> None:
        """They break no promise either, and every outcome of an encounter occurs."""
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

    def test_without_faults_every_mating_has_both_sides_at_once(self) -> None:
        """No robot is ever in doubt, gives up, or waits for a partner that is offline."""
        report = simulate(1, faults=Faults())
        assert not report.violations, str(report)
        assert report.matings > 10
        assert report.conceptions > 10
        assert not {"doubt", "orphaned", "resolved", "storage", "crashes"} & set(+report.counts)

    def test_a_robot_that_has_lost_a_single_link_reconnects(self) -> None:
        """Where single links are clogged for seconds, a robot whose peer acts and is not online reconnects."""
        reports = [simulate(seed, faults=Faults(clogs=True)) for seed in range(10)]
        assert not [str(report) for report in reports if report.violations]
        assert sum(report.counts["reconnects"] for report in reports) > 0

    @pytest.mark.parametrize("robots", [2, 8])
    def test_colonies_of_other_sizes(self, robots: int) -> None:
        """Two robots and eight keep the same promises."""
        for seed in range(3):
            report = simulate(seed, robots, ROUGH)
            assert not report.violations, str(report)


class TestRepeatability:
    """A seed determines everything."""

    def test_the_same_seed_gives_the_same_colony(self) -> None:
        """The same history and the same messages, whatever hashes Python uses; another seed gives others."""
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

    def test_a_failure_names_the_command_that_repeats_it(self) -> None:
        """A report with a violation ends with the command; one without has none."""
        failed = Report(7, 3, draw_faults(Random(7)), violations=["a promise"])
        assert str(failed).endswith("crcolony simulate --seeds 1 --seed 7 --robots 3")
        assert "VIOLATION a promise" in str(failed)
        assert "repeat" not in str(Report(7, 3, Faults()))


def assert_caught(text: str, faults: Faults, seeds: int = 10) -> None:
    """Assert that a simulation reports a violation with this text, in at most so many colonies."""
    violations: list[str] = []
    for seed in range(seeds):
        violations += simulate(seed, faults=faults).violations
        if any(text in violation for violation in violations):
            return
    pytest.fail(f"not reported: {violations}")


CRASHES = Faults(crash_operations=30.0)
"""Processes crash between any two operations."""
FULL_DISKS = Faults(full_disks=True)
"""Disks are full for a while."""


class TestSabotage:
    """Each test breaks one thing and names the violation that is reported."""

    def test_sending_before_writing(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """A robot that sends what is not on its disk yet is reported."""
        carry_out = MatingDriver._carry_out

        def send_first(self: MatingDriver, now_s: float, effects: list[Effect]) -> None:
            carry_out(self, now_s, sorted(effects, key=lambda effect: not isinstance(effect, Send)))

        monkeypatch.setattr(MatingDriver, "_carry_out", send_first)
        assert_caught("but on its disk is", Faults())

    def test_forgetting_decisions_that_are_newer_than_the_snapshot(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """A robot that restarts without its last conceptions is reported."""
        monkeypatch.setattr(RobotStore, "decisions_since", lambda self: [])
        assert_caught("a conception is lost in a restart", CRASHES)

    def test_drawing_the_same_numbers_again(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """A robot that restarts with random numbers that it has used already is reported."""
        replay = MatingDecisions.replay

        def replay_without_stream(
            self: MatingDecisions, record: EncounterRecord, decision: Decision
        ) -> bool:
            stream = self._robot.stream.copy()
            conceived = replay(self, record, decision)
            self._robot.stream[...] = stream
            return conceived

        monkeypatch.setattr(MatingDecisions, "replay", replay_without_stream)
        assert_caught("would draw the same numbers again", CRASHES)

    def test_accepting_envelopes_of_another_colony(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """A robot that accepts genes signed for another colony has genes that its partner did not send."""
        monkeypatch.setattr(mating_driver, "has_valid_signature", lambda envelope, colony: True)
        assert_caught("has genes its partner did not send", Faults(forgery=0.5, tail=0.1))

    def test_accepting_a_commit_of_another_colony(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """A responder that accepts a decision signed for another colony mates alone."""
        monkeypatch.setattr(mating_driver, "has_valid_signature", lambda envelope, colony: True)
        assert_caught("only one of the two mated", Faults(forgery=0.5, tail=0.1, loss=0.2))

    def test_not_rolling_back_what_a_full_disk_refused(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """A robot that continues as if a decision were on its disk is reported when it sends it."""
        monkeypatch.setattr(MatingStateMachine, "rollback", lambda self, now_s, write: [])
        assert_caught("but on its disk is", FULL_DISKS)

    def test_keeping_an_offspring_that_a_full_disk_refused(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """A pool with an offspring without a decision is reported."""
        monkeypatch.setattr(MatingDecisions, "rollback", lambda self: None)
        assert_caught("conceptions, ", FULL_DISKS)

    def test_mating_before_being_on_the_disk(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Agents that mate before their birth is saved: after a crash others are born with their names."""
        never = property(lambda self: False, lambda self, value: None)
        monkeypatch.setattr(RobotNode, "_has_unsaved_births", never, raising=False)
        assert_caught("sends genes of an agent that is not on its disk", FULL_DISKS)

    def test_forgetting_open_encounters(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """A robot that restarts without its open encounters leaves its partner alone with a mating."""
        monkeypatch.setattr(RobotStore, "open_records", lambda self: [])
        assert_caught("only one of the two mated", CRASHES)

    def test_repeating_an_incarnation(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """A robot that does not count its starts is reported."""
        monkeypatch.setattr(RobotStore, "begin_incarnation", lambda self, unix_s: 5)
        assert_caught("repeats incarnation 5", CRASHES, seeds=1)

    def test_leaving_a_partner_in_doubt(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """An initiator that does not answer about an unknown encounter leaves its partner waiting for ever."""
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
        assert_caught("still prepared at the end", CRASHES)

    def test_an_unexpected_error(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """An exception in a robot is a violation that names the place, and the colony continues."""

        def fail(self: RobotNode, now_s: float) -> None:
            raise KeyError("sabotage")

        monkeypatch.setattr(RobotNode, "handle_timeouts", fail)
        assert_caught("KeyError at test_simulate.py", Faults(loss=0.3), seeds=3)
