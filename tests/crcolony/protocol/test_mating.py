"""The initiator and the responder of a mating, message by message."""

import pytest

from crcolony.protocol.encounters import EncounterRecord, OutcomeReport, Send, Write
from crcolony.protocol.mating_messages import Abort, Accept, Commit, Done, Propose, Refuse
from tests.support.mating_examples import (
    AB,
    ACCEPT,
    ENVELOPE,
    LIMITS,
    NONCE,
    OF_A,
    OF_B,
    OF_C,
    OTHER_SCHEMA,
    PROPOSE,
    SCHEMA,
    TICK,
    A,
    B,
    C,
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


class TestInitiator:
    """The robot that proposes and decides."""

    def test_a_contact_makes_the_smaller_id_propose_at_once(self) -> None:
        """The proposal has its agent and genes, the contact's nonce and the next number; nothing is written."""
        robot = mating(A)
        assert report_contact(robot, B, OF_A) == [Send(B, PROPOSE)]
        assert states(robot) == ["proposed"]

    def test_accept_decides_and_commits(self) -> None:
        """The decision, with the partner's genes and signed envelope, is written before Commit is sent."""
        robot = proposed()
        write, report, send = receive(robot, ACCEPT)
        assert isinstance(write, Write)
        assert write.decided == write.records[0]
        assert write.decided.partner == OF_B
        assert write.decided.own == OF_A
        assert (write.decided.proof, write.decided.nonce, write.decided.tick) == (
            ENVELOPE, NONCE, TICK,
        )  # fmt: skip
        assert isinstance(report, OutcomeReport)
        assert report.outcome == "mated"
        assert send == Send(B, Commit(AB))
        assert states(robot) == ["decided"]

    def test_refuse_ends_a_proposal(self) -> None:
        """The reason is reported."""
        robot = proposed()
        (report,) = receive(robot, Refuse(AB, "busy"))
        assert report == OutcomeReport("refused", B, AB, "busy")
        assert states(robot) == []

    def test_a_proposal_without_an_answer_is_given_up(self) -> None:
        """The initiator sends Abort, in case the partner is prepared."""
        robot = proposed()
        effects = robot.handle_timeouts(LIMITS.propose_s)
        assert messages(effects) == [Abort(AB)]
        assert outcomes(effects) == ["expired"]
        assert states(robot) == []

    def test_a_proposal_is_retried_with_doubled_intervals(self) -> None:
        """The first retry is after retry_s, each later one after twice as long."""
        robot = proposed()
        times = []
        while robot.next_s < LIMITS.propose_s:
            now_s = robot.next_s
            if messages(robot.handle_timeouts(now_s)) == [PROPOSE]:
                times.append(round(now_s, 3))
        assert times == [0.2, 0.6, 1.4]

    def test_a_commit_is_retried_until_it_is_acknowledged(self) -> None:
        """It is sent again for every repeated Accept and at every retry."""
        robot = decided()
        assert messages(receive(robot, ACCEPT)) == [Commit(AB)]
        assert messages(robot.handle_timeouts(robot.next_s)) == [Commit(AB)]
        assert written_states(receive(robot, Done(AB))) == ["mated"]
        assert states(robot) == []
        assert robot.next_s == float("inf")

    def test_done_decides_nothing(self) -> None:
        """The decision about offspring belongs to the mating, not to its acknowledgement."""
        assert only_write(receive(decided(), Done(AB))).decided is None

    def test_a_decision_without_acknowledgement_is_orphaned_and_kept(self) -> None:
        """It is written as orphaned once, retried at the longest interval, and resolved if the partner returns."""
        robot = decided()
        effects = robot.handle_timeouts(0.1 + LIMITS.orphan_s)
        assert outcomes(effects) == ["orphaned"]
        assert only_write(effects).records[0].orphaned
        assert only_write(effects).decided is None
        assert robot.next_s == pytest.approx(0.1 + LIMITS.orphan_s + LIMITS.max_retry_s)
        assert messages(robot.handle_timeouts(robot.next_s)) == [Commit(AB)]
        assert written_states(robot.give_up(1e9, AB)) == []
        effects = receive(robot, Done(AB))
        assert written_states(effects) == ["mated"]
        assert outcomes(effects) == ["resolved"]

    def test_an_unknown_encounter_is_aborted(self) -> None:
        """A robot that crashed before it decided does not know its old proposals: presumed abort."""
        robot = mating(A, incarnation=2)
        assert messages(receive(robot, ACCEPT)) == [Abort(AB)]

    def test_an_encounter_of_the_future_is_not_answered(self) -> None:
        """This robot has never proposed it, so the message is not worth verifying."""
        robot = mating(A)
        assert not robot.expects(ACCEPT)
        assert receive(robot, ACCEPT) == []

    def test_an_accept_for_another_contact_or_schema_decides_nothing(self) -> None:
        """The answer must have the nonce and the schema of the proposal."""
        robot = proposed()
        for accept in (
            Accept(AB, NONCE + 1, SCHEMA, OF_B.agent, OF_B.genes),
            Accept(AB, NONCE, OTHER_SCHEMA, OF_B.agent, OF_B.genes),
        ):
            assert receive(robot, accept) == []
        assert states(robot) == ["proposed"]

    def test_refuse_and_abort_do_not_change_a_decision(self) -> None:
        """A copy of the proposal may have been refused before another was accepted."""
        robot = decided()
        assert receive(robot, Refuse(AB, "stale")) == []
        assert receive(robot, Abort(AB)) == []
        assert states(robot) == ["decided"]


class TestResponder:
    """The robot that prepares and then waits for the decision."""

    def test_a_proposal_after_a_contact_prepares(self) -> None:
        """Both offers and the signed envelope are written before Accept is sent; nothing is decided yet."""
        robot = mating(B)
        report_contact(robot, A, OF_B)
        effects = receive(robot, PROPOSE)
        write = only_write(effects)
        assert write.decided is None
        assert write.records == (
            EncounterRecord(AB, "responder", "prepared", NONCE, TICK, OF_B, OF_A, ENVELOPE),
        )
        assert effects.index(write) < effects.index(Send(A, ACCEPT))
        assert messages(effects) == [ACCEPT]

    def test_a_proposal_without_a_contact_is_ignored(self) -> None:
        """The bodies have not met, or at another time: the nonce ties a proposal to a contact."""
        robot = mating(B)
        assert receive(robot, PROPOSE) == []
        report_contact(robot, C, OF_B)
        assert receive(robot, PROPOSE) == []
        report_contact(robot, A, OF_B, nonce=NONCE + 1)
        assert not robot.expects(PROPOSE)
        assert receive(robot, PROPOSE) == []

    def test_a_repeated_proposal_is_accepted_again(self) -> None:
        """The answer is the same, and nothing is written twice."""
        robot = prepared()
        assert receive(robot, PROPOSE) == [Send(A, ACCEPT)]

    def test_an_old_proposal_is_stale(self) -> None:
        """It is refused even if the same contact is reported again."""
        robot = prepared()
        receive(robot, Abort(AB))
        report_contact(robot, A, OF_B)
        assert messages(receive(robot, PROPOSE)) == [Refuse(AB, "stale")]

    def test_a_newer_proposal_of_the_same_robot_replaces_an_older(self) -> None:
        """An initiator proposes again only if it did not decide the older; both are written in one transaction."""
        robot = prepared()
        report_contact(robot, A, OF_B, nonce=8)
        newer = Propose(encounter(A, B, 2), 8, SCHEMA, OF_A.agent, OF_A.genes)
        effects = receive(robot, newer)
        write = only_write(effects)
        assert [(r.encounter.count, r.state) for r in write.records] == [
            (1, "aborted"),
            (2, "prepared"),
        ]
        assert outcomes(effects) == ["aborted"]
        assert [m.encounter.count for m in messages(effects)] == [2]
        assert [record.encounter.count for record in robot.open] == [2]

    def test_commit_mates_and_is_acknowledged(self) -> None:
        """The mating and the decision about offspring are written before Done is sent."""
        effects = receive(prepared(), Commit(AB))
        write = only_write(effects)
        assert write.decided == write.records[0]
        assert write.decided.partner == OF_A
        assert outcomes(effects) == ["mated"]
        assert effects[-1] == Send(A, Done(AB))

    def test_a_repeated_commit_is_acknowledged_again(self) -> None:
        """There is no second decision, not even after a crash."""
        robot = prepared()
        receive(robot, Commit(AB))
        assert receive(robot, Commit(AB)) == [Send(A, Done(AB))]
        restarted = mating(B, incarnation=2)
        restarted.restore(0.0, [], {A: (AB.number, True)})
        assert receive(restarted, Commit(AB)) == [Send(A, Done(AB))]

    def test_commit_of_an_unknown_encounter_is_ignored(self) -> None:
        """So is the commit of an encounter that was aborted."""
        assert receive(mating(B), Commit(AB)) == []
        robot = prepared()
        receive(robot, Abort(AB))
        assert receive(robot, Commit(AB)) == []

    def test_abort_ends_it(self) -> None:
        """The abort is written, so that the number is never accepted again."""
        robot = prepared()
        effects = receive(robot, Abort(AB))
        assert written_states(effects) == ["aborted"]
        assert outcomes(effects) == ["aborted"]
        assert states(robot) == []

    def test_in_doubt_it_asks_for_the_decision_and_is_free_for_others(self) -> None:
        """After doubt_s it sends Accept again, counts a doubt once, and may propose to other robots."""
        robot = prepared()
        assert robot.is_engaged
        effects = robot.handle_timeouts(robot.next_s)
        assert messages(effects) == [ACCEPT]
        assert outcomes(effects) == ["doubt"]
        assert robot.doubts == 1
        assert not robot.is_engaged
        assert outcomes(robot.handle_timeouts(robot.next_s)) == []
        assert len(messages(report_contact(robot, C, OF_B))) == 1
        effects = receive(robot, Commit(AB))
        assert outcomes(effects) == ["mated", "resolved"]
        assert robot.doubts == 0

    def test_in_doubt_it_accepts_others(self) -> None:
        """A third robot's proposal is accepted while the first encounter waits for its decision."""
        robot = mating(C)
        report_contact(robot, A, OF_C)
        first = Propose(encounter(A, C), NONCE, SCHEMA, OF_A.agent, OF_A.genes)
        receive(robot, first)
        robot.handle_timeouts(robot.next_s)
        report_contact(robot, B, OF_C, now_s=0.7, nonce=9)
        second = Propose(encounter(B, C), 9, SCHEMA, OF_B.agent, OF_B.genes)
        assert written_states(receive(robot, second, 0.8)) == ["prepared"]
        assert outcomes(receive(robot, Abort(first.encounter), 0.9)) == ["aborted", "resolved"]
        assert states(robot) == ["prepared"]

    def test_a_prepared_encounter_whose_initiator_stays_away_is_orphaned(self) -> None:
        """It is kept, retried at the longest interval, and resolved if the initiator returns."""
        robot = prepared()
        receive(robot, PROPOSE)
        effects = robot.handle_timeouts(0.1 + LIMITS.orphan_s)
        assert outcomes(effects) == ["orphaned"]
        assert only_write(effects).records[0].orphaned
        assert robot.next_s == pytest.approx(0.1 + LIMITS.orphan_s + LIMITS.max_retry_s)
        assert messages(robot.handle_timeouts(robot.next_s)) == [ACCEPT]
        assert robot.doubts == 1
        effects = receive(robot, Abort(AB))
        assert written_states(effects) == ["aborted"]
        assert outcomes(effects) == ["aborted", "resolved"]

    def test_another_schema_is_refused(self) -> None:
        """Robots of another species do not mate."""
        robot = mating(B)
        report_contact(robot, A, OF_B)
        proposal = Propose(AB, NONCE, OTHER_SCHEMA, OF_A.agent, OF_A.genes)
        effects = receive(robot, proposal)
        assert messages(effects) == [Refuse(AB, "schema")]
        assert outcomes(effects) == ["refused"]
        assert robot.open == ()
