"""What a failed write and a crash leave of a mating."""

from dataclasses import replace

from crcolony.protocol.mating_messages import Abort, Commit, Done, Propose, Refuse
from tests.support.mating_examples import (
    AB,
    ACCEPT,
    LIMITS,
    OF_A,
    OF_B,
    PROPOSE,
    SCHEMA,
    A,
    B,
    decided,
    encounter,
    mating,
    messages,
    only_write,
    outcomes,
    prepared,
    proposed,
    receive,
    report_contact,
    states,
    written_states,
)


class TestDisk:
    """A failed write is rolled back, and what is on disk is restored."""

    def test_a_preparation_that_is_rolled_back_is_refused(self) -> None:
        """The initiator receives Refuse because of the storage."""
        robot = mating(B)
        report_contact(robot, A, OF_B)
        write = only_write(receive(robot, PROPOSE))
        effects = robot.rollback(0.2, write)
        assert messages(effects) == [Refuse(AB, "storage")]
        assert outcomes(effects) == ["storage"]
        assert robot.open == ()

    def test_a_replacement_that_is_rolled_back_leaves_the_older(self) -> None:
        """Both records are written or neither: the older encounter stays prepared."""
        robot = prepared()
        report_contact(robot, A, OF_B, nonce=8)
        newer = Propose(encounter(A, B, 2), 8, SCHEMA, OF_A.agent, OF_A.genes)
        effects = robot.rollback(0.3, only_write(receive(robot, newer)))
        assert messages(effects) == [Refuse(newer.encounter, "storage")]
        assert [(r.encounter, r.state) for r in robot.open] == [(AB, "prepared")]

    def test_a_decision_that_is_rolled_back_is_aborted(self) -> None:
        """Commit was not sent."""
        robot = proposed()
        effects = robot.rollback(0.2, only_write(receive(robot, ACCEPT)))
        assert messages(effects) == [Abort(AB)]
        assert robot.open == ()
        assert messages(receive(robot, ACCEPT)) == [Abort(AB)]

    def test_a_mating_that_is_rolled_back_can_still_take_place(self) -> None:
        """The responder stays prepared, and the decision is made when the initiator sends Commit again."""
        robot = prepared()
        robot.rollback(0.2, only_write(receive(robot, Commit(AB))))
        assert states(robot) == ["prepared"]
        effects = receive(robot, Commit(AB), 0.3)
        assert only_write(effects).decided is not None
        assert messages(effects) == [Done(AB)]

    def test_an_acknowledgement_that_is_rolled_back_is_requested_again(self) -> None:
        """The initiator sends Commit again and receives Done again."""
        robot = decided()
        robot.rollback(0.2, only_write(receive(robot, Done(AB))))
        assert messages(robot.handle_timeouts(robot.next_s)) == [Commit(AB)]
        assert written_states(receive(robot, Done(AB))) == ["mated"]

    def test_what_is_unresolved_on_disk_is_restored_after_a_crash(self) -> None:
        """The initiator sends Commit, the responder asks for the decision; neither is engaged by it."""
        for before, message in ((decided(), Commit(AB)), (prepared(), ACCEPT)):
            robot = mating(before.me, incarnation=2)
            robot.restore(100.0, before.open, {})
            assert robot.open == before.open
            assert not robot.is_engaged
            assert robot.doubts == states(robot).count("prepared")
            assert messages(robot.handle_timeouts(robot.next_s)) == [message]

    def test_an_orphan_on_disk_is_retried_at_the_longest_interval_after_a_crash(self) -> None:
        """It is not counted again."""
        (record,) = prepared().open
        robot = mating(B, incarnation=2)
        robot.restore(100.0, [replace(record, orphaned=True)], {})
        assert robot.next_s == 100.0 + LIMITS.max_retry_s
        assert outcomes(robot.handle_timeouts(1000.0)) == []

    def test_numbers_of_a_new_incarnation_are_new(self) -> None:
        """A proposal after a crash is newer than any before."""
        robot = mating(A, incarnation=2)
        (proposal,) = messages(report_contact(robot, B, OF_A))
        assert proposal.encounter.number == (2, 1)
        assert proposal.encounter.number > (1, 99)

    def test_marks_on_disk_make_old_proposals_stale_after_a_crash(self) -> None:
        """A contact that is reported again does not change that."""
        robot = mating(B, incarnation=2)
        robot.restore(0.0, [], {A: ((1, 1), False)})
        report_contact(robot, A, OF_B)
        assert messages(receive(robot, PROPOSE)) == [Refuse(AB, "stale")]
        assert receive(robot, Commit(AB)) == []
