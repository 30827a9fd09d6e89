"""Both mate or neither does, at most once, in every order of events within bounds.

`mating_explorer.py` says what may happen and what is abstracted; timers are tested in `test_open_encounters.py`. The
second half of this file sabotages the protocol or its caller, one line each, and shows that the explorer finds it: a
search that never finds anything proves nothing.
"""

from collections.abc import Sequence
from dataclasses import replace

import pytest

from crcolony.protocol.encounters import Effect, EncounterRecord, Send, Write
from crcolony.protocol.identity import RobotId
from crcolony.protocol.mating import MatingStateMachine
from crcolony.protocol.mating_messages import (
    Accept,
    Commit,
    Done,
    MatingMessage,
)
from crcolony.protocol.signed_envelope import SignedEnvelope
from tests.support.explored_robot import LIMITS, NOW_S, SCHEMA, Bounds, Caller, Decide, Disk, Kind
from tests.support.mating_explorer import Report, explore
from tests.support.sabotaged_mating import (
    AppliesLateRefusal,
    ForgetsUnacknowledged,
    GivesUpDecided,
    GuessesAbort,
    GuessesCommit,
    IgnoresAbort,
    IgnoresMarks,
    IgnoresNonce,
    OffersAgentOfOlderContact,
    PresumesCommit,
    PresumesNothing,
)

PAIR = (0, 1)
ONCE = Bounds((PAIR,), crashes=1)
TWICE = Bounds((PAIR, PAIR))


def assert_kept(bounds: Bounds, least: int) -> None:
    """Assert that no promise is broken within bounds, in an exploration that has seen matings and enough states."""
    report = explore(bounds)
    print(report)
    assert report.violation is None, str(report)
    assert report.matings > 0
    assert report.states >= least


def assert_caught(kind: Kind, caller: Caller, bounds: Bounds = ONCE) -> Report:
    """Assert that the explorer finds this way of breaking this promise, and return its counterexample."""
    report = explore(bounds, caller, only=kind)
    assert report.violation is not None, f"not found: {report}"
    assert report.violation.kind == kind, str(report)
    return report


class TestPromises:
    """Loss, duplication, delay, reordering, replay and forgery have no bound in any of these."""

    def test_one_contact_two_crashes_a_full_disk_and_a_contact_reported_twice(self) -> None:
        """All faults at once, for two robots that meet once."""
        assert_kept(Bounds((PAIR,), crashes=2, failed_writes=1, repeats=1), least=30_000)

    def test_two_contacts_and_two_crashes(self) -> None:
        """One pair meets twice, so that a second encounter begins while the first is unresolved."""
        assert_kept(Bounds((PAIR, PAIR), crashes=2), least=90_000)

    def test_two_contacts_a_crash_and_a_full_disk(self) -> None:
        """One pair meets twice, and one of them fails to write, once, and crashes."""
        assert_kept(Bounds((PAIR, PAIR), crashes=1, failed_writes=1), least=55_000)

    @pytest.mark.parametrize(
        "contacts", [(PAIR, (0, 2)), (PAIR, (1, 2)), ((0, 2), (1, 2))], ids=["A", "B", "C"]
    )
    def test_three_robots_and_a_crash(self, contacts: tuple[tuple[int, int], ...]) -> None:
        """Two pairs have one robot in common, so that it is busy with one while the other proposes."""
        assert_kept(Bounds(contacts, robots=3, crashes=1), least=40_000)

    def test_three_robots_and_a_full_disk(self) -> None:
        """The robot in common fails to write, once, while both others wait for it."""
        assert_kept(Bounds((PAIR, (1, 2)), robots=3, failed_writes=1), least=20_000)

    def test_a_counterexample_is_printed_step_by_step(self) -> None:
        """The shortest way to break a promise is a list of steps of robots."""
        report = assert_caught("sent too early", SendsAcceptFirst())
        assert report.steps[:2] == ("A meets B (nonce 1)", "B meets A (nonce 1)")
        assert report.steps[-1].endswith("B receives Propose AB1.1 (A1, nonce 1)")
        assert str(report).startswith("after 4 steps, sent too early: Accept AB1.1")


NOT_PROMISED_AFTER_A_RESTORE: frozenset[Kind] = frozenset(("one-sided", "left open"))


class TestRestored:
    """A robot is copied at any moment, and later restored from that copy: what holds then, and what does not."""

    def test_it_decides_at_most_once_about_an_encounter(self) -> None:
        """With a crash at any other moment too: what its disk knows it decides once, what was lost never again."""
        bounds = Bounds((PAIR,), crashes=2, has_backups=True)
        report = explore(bounds, ignored=NOT_PROMISED_AFTER_A_RESTORE)
        assert report.violation is None, str(report)
        assert report.states >= 20_000
        assert report.matings > 0

    @pytest.mark.slow
    def test_so_it_does_when_the_pair_meets_again(self) -> None:
        """The second encounter may begin before, between or after the copy and its restore."""
        bounds = replace(TWICE, crashes=1, has_backups=True)
        report = explore(bounds, ignored=NOT_PROMISED_AFTER_A_RESTORE)
        assert report.violation is None, str(report)
        assert report.states >= 1_000_000

    def test_a_mating_that_it_forgot_stays_with_its_partner_alone(self) -> None:
        """So a copy is the last resort: a robot that is stopped, copied and moved has forgotten nothing."""
        report = assert_caught("one-sided", Caller(), Bounds((PAIR,), crashes=1, has_backups=True))
        assert any("is restored from its backup" in step for step in report.steps)

    def test_a_partner_that_waits_for_it_waits_for_ever(self) -> None:
        """Its commit is of an encounter that the restored robot does not know; it is shown as orphaned."""
        bounds = Bounds((PAIR,), crashes=1, has_backups=True)
        report = assert_caught("left open", Caller(), bounds)
        assert report.violation is not None
        assert "stays decided at its initiator" in str(report.violation)


# Sabotaged callers -----------------------------------------------------------------------------------------------


class SendsFirst(Caller):
    """Sends a message before the write on which it depends."""

    kind: type[MatingMessage]

    def in_order(self, effects: Sequence[Effect]) -> Sequence[Effect | Decide]:
        return sorted(
            effects, key=lambda e: not (isinstance(e, Send) and isinstance(e.message, self.kind))
        )


class SendsAcceptFirst(SendsFirst):
    kind = Accept


class SendsCommitFirst(SendsFirst):
    kind = Commit


class SendsDoneFirst(SendsFirst):
    kind = Done


class KeepsMarksInMemory(Caller):
    def restore(self, me: RobotId, disk: Disk) -> MatingStateMachine:
        mating = self.mating(me, disk.incarnation, SCHEMA, LIMITS)
        mating.restore(NOW_S, filter(self.is_open, disk.records), {})
        return mating


class KeepsIncarnationInMemory(Caller):
    def start(self, me: RobotId, disk: Disk) -> tuple[Disk, MatingStateMachine]:
        disk = replace(disk, incarnation=1)
        return disk, self.restore(me, disk)


class SkipsSignature(Caller):
    def has_valid_signature(self, envelope: SignedEnvelope) -> bool:
        return True


class ForgetsDecided(Caller):
    def is_open(self, record: EncounterRecord) -> bool:
        return record.state == "prepared"


class ForgetsPrepared(Caller):
    def is_open(self, record: EncounterRecord) -> bool:
        return record.state == "decided"


class DoesNotRollBack(Caller):
    def handle_failed_write(self, mating: MatingStateMachine, write: Write) -> list[Effect]:
        return []


class DecidesApart(Caller):
    """Decides about offspring in a transaction of its own, after the one that records the mating."""

    decides_apart = True

    def in_order(self, effects: Sequence[Effect]) -> Sequence[Effect | Decide]:
        done: list[Effect | Decide] = []
        for effect in effects:
            done.append(effect)
            if isinstance(effect, Write) and effect.decided:
                done.append(Decide(effect.decided))
        return done


class TestSabotagedCaller:
    """One line of the caller is wrong."""

    def test_accept_before_it_is_prepared_on_disk(self) -> None:
        """It is found at once; undetected, a crash between the two would make the mating one-sided."""
        assert_caught("sent too early", SendsAcceptFirst())
        assert_caught("one-sided", SendsAcceptFirst())

    def test_commit_before_it_is_decided_on_disk(self) -> None:
        """It is found at once; undetected, a crash between the two would make the mating one-sided."""
        assert_caught("sent too early", SendsCommitFirst())
        assert_caught("one-sided", SendsCommitFirst())

    def test_done_before_it_is_mated_on_disk(self) -> None:
        """It is found at once; undetected, a crash between the two would make the mating one-sided."""
        assert_caught("sent too early", SendsDoneFirst())
        assert_caught("one-sided", SendsDoneFirst())

    def test_marks_kept_in_memory_only(self) -> None:
        """After a crash an old Propose and its Commit, replayed at a contact reported again, mate a second time."""
        bounds = Bounds((PAIR,), crashes=1, repeats=1)
        assert_caught("decided twice", KeepsMarksInMemory(), bounds)

    def test_incarnation_kept_in_memory_only(self) -> None:
        """A number that is used again lets the Abort of an old encounter end a new one."""
        bounds = replace(TWICE, crashes=1)
        assert_caught("one-sided", KeepsIncarnationInMemory(), bounds)

    def test_signatures_skipped(self) -> None:
        """A robot acts on a forged envelope."""
        assert_caught("forged", SkipsSignature())

    def test_decided_encounters_not_restored_after_a_crash(self) -> None:
        """The initiator aborts what it has decided."""
        assert_caught("one-sided", ForgetsDecided())

    def test_prepared_encounters_not_restored_after_a_crash(self) -> None:
        """The responder ignores the decision for which it is prepared."""
        assert_caught("left open", ForgetsPrepared())

    def test_a_failed_write_not_rolled_back(self) -> None:
        """The state in memory is ahead of the disk, and messages are sent that depend on no record."""
        bounds = Bounds((PAIR,), failed_writes=1)
        assert_caught("sent too early", DoesNotRollBack(), bounds)
        assert_caught("one-sided", DoesNotRollBack(), bounds)

    def test_offspring_decided_in_a_transaction_of_its_own(self) -> None:
        """A crash between the two loses the decision for good."""
        assert_caught("no decision", DecidesApart())


# Sabotaged state machines ----------------------------------------------------------------------------------------


def calling(mating: type[MatingStateMachine]) -> Caller:
    """Return a correct caller of a sabotaged state machine."""
    caller = Caller()
    caller.mating = mating
    return caller


class TestSabotagedMating:
    """One row or rule of the state machine is wrong."""

    def test_marks_ignored(self) -> None:
        """A Propose of an encounter that is over, replayed at a contact reported again, mates a second time."""
        bounds = Bounds((PAIR,), repeats=1)
        assert_caught("decided twice", calling(IgnoresMarks), bounds)

    def test_in_doubt_commit_guessed(self) -> None:
        """The initiator may have given up before."""
        assert_caught("one-sided", calling(GuessesCommit))

    def test_in_doubt_abort_guessed(self) -> None:
        """The initiator may have decided, and its Commit may still arrive."""
        assert_caught("one-sided", calling(GuessesAbort))

    def test_a_decided_encounter_given_up(self) -> None:
        """A Commit that was sent cannot be revoked."""
        assert_caught("one-sided", calling(GivesUpDecided))

    def test_accept_of_an_unknown_encounter_answered_with_commit(self) -> None:
        """An encounter without a record was never decided."""
        assert_caught("sent too early", calling(PresumesCommit))
        assert_caught("one-sided", calling(PresumesCommit))

    def test_accept_of_an_unknown_encounter_not_answered(self) -> None:
        """Its responder would be in doubt forever."""
        assert_caught("left open", calling(PresumesNothing))

    def test_nonce_not_checked(self) -> None:
        """A robot mates with one that it met at another time, or never."""
        assert_caught("no contact", calling(IgnoresNonce), TWICE)

    def test_a_newer_proposal_while_the_older_is_unacknowledged(self) -> None:
        """The responder infers from the newer that the older was not decided, and aborts it."""
        assert_caught("one-sided", calling(ForgetsUnacknowledged), TWICE)

    def test_a_late_refusal_applied(self) -> None:
        """One copy of the Propose was refused and another accepted, so the refusal is void."""
        bounds = Bounds((PAIR,), repeats=1)
        assert_caught("one-sided", calling(AppliesLateRefusal), bounds)

    def test_abort_ignored(self) -> None:
        """Its responder would be in doubt forever."""
        assert_caught("left open", calling(IgnoresAbort))

    def test_an_agent_of_another_contact_offered(self) -> None:
        """The parent of the offspring would not be the agent that was in control when the robots met."""
        assert_caught("wrong genes", calling(OffersAgentOfOlderContact), TWICE)
