"""Proposals that cross, and three robots that meet: a robot is engaged with one other at a time."""

from crcolony.protocol.encounters import Offer
from crcolony.protocol.mating import MatingStateMachine
from crcolony.protocol.mating_messages import (
    Abort,
    Accept,
    Commit,
    Done,
    Propose,
    Refuse,
    receiver_of,
)
from tests.support.mating_examples import (
    AB,
    ACCEPT,
    BA,
    COUNTER,
    LIMITS,
    NONCE,
    OF_A,
    OF_B,
    OF_C,
    PROPOSE,
    SCHEMA,
    A,
    B,
    C,
    D,
    decided,
    encounter,
    mating,
    messages,
    outcomes,
    prepared,
    proposed,
    receive,
    report_contact,
    states,
)


class TestCrossedProposals:
    """Both robots propose: the one with the smaller id remains the initiator."""

    def both_have_proposed(self) -> tuple[MatingStateMachine, MatingStateMachine]:
        """Return A and B after each has proposed to the other."""
        a, b = mating(A), mating(B)
        report_contact(b, A, OF_B)
        assert messages(b.handle_timeouts(LIMITS.patience_s)) == [COUNTER]
        report_contact(a, B, OF_A)
        return a, b

    def test_the_larger_id_waits_before_it_proposes(self) -> None:
        """It waits for patience_s and accepts a proposal that arrives before."""
        robot = mating(B)
        assert report_contact(robot, A, OF_B) == []
        assert robot.next_s == LIMITS.patience_s
        assert robot.handle_timeouts(LIMITS.patience_s - 0.01) == []
        assert messages(receive(robot, PROPOSE)) == [ACCEPT]

    def test_the_larger_id_yields(self) -> None:
        """It drops its own proposal and offers the same agent as the responder."""
        _, b = self.both_have_proposed()
        assert messages(receive(b, PROPOSE)) == [ACCEPT]
        assert [(r.role, r.own) for r in b.open] == [("responder", OF_B)]

    def test_the_smaller_id_does_not_yield(self) -> None:
        """It waits until the other has received its proposal."""
        a, _ = self.both_have_proposed()
        assert receive(a, COUNTER) == []
        assert states(a) == ["proposed"]

    def test_a_proposal_that_was_yielded_is_aborted_if_it_is_accepted(self) -> None:
        """One contact leads to one mating."""
        _, b = self.both_have_proposed()
        receive(b, PROPOSE)
        accept = Accept(BA, NONCE, SCHEMA, OF_A.agent, OF_A.genes)
        assert messages(receive(b, accept)) == [Abort(BA)]
        assert states(b) == ["prepared"]

    def test_a_smaller_id_that_is_engaged_refuses(self) -> None:
        """It proposes as soon as it is free, while the contact is recent."""
        a = mating(A)
        report_contact(a, C, OF_A, nonce=9)
        assert report_contact(a, B, OF_A) == []
        assert messages(receive(a, COUNTER)) == [Refuse(BA, "busy")]
        (proposal,) = messages(receive(a, Refuse(encounter(A, C), "busy")))
        assert proposal.encounter == encounter(A, B, 2)

    def test_it_offers_the_agent_of_the_contact_whose_nonce_is_quoted(self) -> None:
        """The robots met again before their proposals crossed, and another agent was in control."""
        b = mating(B)
        report_contact(b, A, OF_B)
        b.handle_timeouts(LIMITS.patience_s)
        newer = Offer("ben", b"bencoded")
        report_contact(b, A, newer, now_s=1.0, nonce=8)
        (accept,) = messages(receive(b, Propose(AB, 8, SCHEMA, OF_A.agent, OF_A.genes)))
        assert isinstance(accept, Accept)
        assert (accept.agent, accept.nonce) == ("ben", 8)


class TestThreeRobots:
    """A robot is engaged with one other robot at a time."""

    def test_an_engaged_robot_refuses_a_third(self) -> None:
        """It is engaged while it waits for a decision or for an answer to its own proposal."""
        for robot in (prepared(), self.b_proposed_to_d()):
            report_contact(robot, C, OF_B, nonce=9)
            proposal = Propose(encounter(C, B), 9, SCHEMA, OF_C.agent, OF_C.genes)
            effects = receive(robot, proposal)
            assert messages(effects) == [Refuse(encounter(C, B), "busy")]
            assert outcomes(effects) == ["busy"]

    def b_proposed_to_d(self) -> MatingStateMachine:
        """Return B, which has proposed to D."""
        robot = mating(B)
        report_contact(robot, D, OF_B)
        return robot

    def test_an_engaged_robot_proposes_to_a_third_when_it_is_free(self) -> None:
        """A contact is kept for contact_s."""
        robot = proposed()
        assert report_contact(robot, C, OF_A, nonce=9) == []
        *_, proposal = messages(receive(robot, ACCEPT, 0.2))
        assert isinstance(proposal, Propose)
        assert proposal.encounter == encounter(A, C, 2)
        assert proposal.nonce == 9

    def test_the_last_contact_comes_first(self) -> None:
        """Its robot is the most likely to be near still."""
        robot = proposed()
        report_contact(robot, C, OF_A, nonce=8)
        report_contact(robot, D, OF_A, nonce=9)
        (proposal,) = messages(receive(robot, Refuse(AB, "busy")))
        assert receiver_of(proposal) == D

    def test_a_decided_encounter_does_not_engage(self) -> None:
        """Its partner's acknowledgement may take any time."""
        robot = decided()
        assert not robot.is_engaged
        assert len(messages(report_contact(robot, C, OF_A, nonce=9))) == 1

    def test_no_encounter_begins_with_a_robot_that_has_not_acknowledged(self) -> None:
        """That robot would infer from a newer proposal that the older was not decided."""
        robot = decided()
        assert messages(report_contact(robot, B, OF_A, now_s=0.2, nonce=9)) == [Commit(AB)]
        proposal = Propose(BA, 9, SCHEMA, OF_B.agent, OF_B.genes)
        assert messages(receive(robot, proposal)) == [Refuse(BA, "busy")]
        report_contact(robot, B, OF_A, now_s=0.3, nonce=10)
        receive(robot, Done(AB), 0.4)
        assert robot.next_s <= 0.4
        (proposal_now,) = messages(robot.handle_timeouts(0.4))
        assert proposal_now.encounter == encounter(A, B, 2)

    def test_messages_to_others_and_from_itself_are_ignored(self) -> None:
        """A robot is never its own partner."""
        robot = mating(C)
        report_contact(robot, A, OF_C)
        assert not robot.expects(PROPOSE)
        myself = Propose(encounter(C, C), NONCE, SCHEMA, "me", bytes(8))
        assert not robot.expects(myself)
        assert receive(robot, PROPOSE) + receive(robot, myself) == []
