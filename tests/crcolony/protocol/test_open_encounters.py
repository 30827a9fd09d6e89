"""Timers and limits of contacts and open encounters."""

import pytest

from crcolony.protocol.encounters import MatingLimits
from crcolony.protocol.mating_messages import Abort, Accept, Commit, Propose, Refuse, receiver_of
from tests.support.mating_examples import (
    AB,
    ACCEPT,
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
    only_write,
    outcomes,
    prepared,
    proposed,
    receive,
    report_contact,
    states,
)


class TestTimers:
    """Contacts, absent peers, and the time of the next timeout."""

    def test_a_contact_expires(self) -> None:
        """After contact_s it leads to no mating."""
        robot = mating(B)
        report_contact(robot, A, OF_B)
        assert robot.is_pending
        assert robot.handle_timeouts(LIMITS.contact_s) == []
        assert not robot.is_pending
        assert receive(robot, PROPOSE, LIMITS.contact_s) == []

    def test_a_hand_over_does_not_change_the_offer(self) -> None:
        """The agent that was in control at the contact mates, whichever is in control when messages arrive."""
        robot = mating(B)
        report_contact(robot, A, OF_B)
        offers = [r.own for r in only_write(receive(robot, PROPOSE, 1.9)).records]
        assert offers == [OF_B]
        assert messages(robot.retry(50.0, AB)) == [ACCEPT]
        mated = only_write(receive(robot, Commit(AB), 99.0)).decided
        assert mated is not None
        assert mated.own == OF_B

    def test_a_partner_that_goes_offline_frees_a_robot(self) -> None:
        """A proposal is given up and a contact discarded; what is prepared stays, in doubt."""
        effects = (robot := proposed()).handle_peer_offline(0.1, B)
        assert messages(effects) == [Abort(AB)]
        assert robot.open == ()
        effects = (robot := prepared()).handle_peer_offline(0.2, A)
        assert outcomes(effects) == ["doubt"]
        assert not robot.is_engaged
        assert states(robot) == ["prepared"]
        robot = prepared()
        assert robot.handle_peer_offline(0.2, C) == []
        assert robot.is_engaged
        robot = mating(B)
        report_contact(robot, A, OF_B)
        assert robot.handle_peer_offline(0.1, A) == []
        assert not robot.is_pending

    def test_a_partner_that_comes_online_is_retried_at_once(self) -> None:
        """Every open encounter with it is retried, no other."""
        robot = decided()
        assert messages(robot.handle_peer_online(9.0, B)) == [Commit(AB)]
        assert robot.handle_peer_online(9.0, C) == []

    def test_next_s_is_the_time_of_the_next_timeout(self) -> None:
        """It is infinite without a timer, then the end of patience_s, then the retry of the open encounter."""
        robot = mating(B)
        assert robot.next_s == float("inf")
        report_contact(robot, A, OF_B, now_s=1.0)
        assert robot.next_s == 1.0 + LIMITS.patience_s
        receive(robot, PROPOSE, 1.1)
        assert robot.next_s == pytest.approx(1.1 + LIMITS.doubt_s)

    def test_every_timeout_at_next_s_moves_next_s(self) -> None:
        """A contact with a robot with which an encounter is open is not due before it expires."""
        robot = decided()
        report_contact(robot, B, OF_A, now_s=0.2, nonce=9)
        for _ in range(100):
            before = robot.next_s
            robot.handle_timeouts(before)
            assert robot.next_s > before

    def test_a_contact_that_cannot_lead_to_a_mating_is_due_when_it_expires(self) -> None:
        """Lockstep waits no longer for it."""
        robot = mating(A, MatingLimits(open=0))
        assert report_contact(robot, B, OF_A) == []
        assert robot.next_s == LIMITS.contact_s
        robot.handle_timeouts(robot.next_s)
        assert not robot.is_pending

    def test_a_copy_is_independent(self) -> None:
        """An event at the copy does not change the original."""
        robot = proposed()
        other = robot.copy()
        receive(other, ACCEPT)
        assert states(robot) == ["proposed"]
        assert states(other) == ["decided"]


class TestLimits:
    """No peer can make a robot's memory grow without bound."""

    def test_with_too_many_open_encounters_there_are_no_new_ones(self) -> None:
        """It neither proposes nor accepts, and completes what is open."""
        robot = mating(B, MatingLimits(open=1))
        report_contact(robot, A, OF_B)
        receive(robot, PROPOSE)
        robot.handle_timeouts(LIMITS.doubt_s + 0.1)
        assert report_contact(robot, D, OF_B, now_s=0.7, nonce=9) == []
        report_contact(robot, C, OF_B, now_s=0.7, nonce=9)
        proposal = Propose(encounter(C, B), 9, SCHEMA, OF_C.agent, OF_C.genes)
        assert messages(receive(robot, proposal, 0.8)) == [Refuse(encounter(C, B), "busy")]
        effects = receive(robot, Abort(AB), 0.9)
        assert [receiver_of(message) for message in messages(effects)] == [C]

    def test_with_too_many_peers_unknown_initiators_are_refused(self) -> None:
        """The last number of an initiator is kept for good, so there is no room for another's."""
        robot = mating(C, MatingLimits(peers=1))
        report_contact(robot, A, OF_C)
        first = Propose(encounter(A, C), NONCE, SCHEMA, OF_A.agent, OF_A.genes)
        receive(robot, first)
        receive(robot, Commit(first.encounter))
        report_contact(robot, B, OF_C, now_s=0.2, nonce=9)
        unknown = Propose(encounter(B, C), 9, SCHEMA, OF_B.agent, OF_B.genes)
        assert messages(receive(robot, unknown, 0.3)) == [Refuse(unknown.encounter, "busy")]
        report_contact(robot, A, OF_C, now_s=0.4, nonce=10)
        known = Propose(encounter(A, C, 2), 10, SCHEMA, OF_A.agent, OF_A.genes)
        assert isinstance(messages(receive(robot, known, 0.5))[0], Accept)
