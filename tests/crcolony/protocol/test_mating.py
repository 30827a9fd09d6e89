"""Every row of the table of `mating.py`, its deadlines and its limits, by example.

`test_mating_explored.py` shows what holds in every order of events. Here A < B < C are three robots; a robot's effects
are read in three parts: what it says, what it writes, what it notes.
"""

from collections.abc import Iterable
from dataclasses import replace

import pytest

from crcolony.protocol.encounters import (
    Effect,
    EncounterRecord,
    MatingLimits,
    Offer,
    OutcomeReport,
    Send,
    Write,
)
from crcolony.protocol.mating import MatingStateMachine
from crcolony.protocol.mating_messages import (
    Abort,
    Accept,
    Commit,
    Done,
    Encounter,
    MatingMessage,
    Propose,
    Refuse,
    receiver_of,
)

A, B, C, D = (name * 16 for name in (b"a", b"b", b"c", b"d"))
SCHEMA, OTHER_SCHEMA = bytes(16), bytes([1] * 16)
NONCE, TICK = 7, 5
OF_A, OF_B, OF_C = (Offer(name, name.encode() * 8) for name in ("ann", "bob", "cy"))
LETTER = b"a letter, sealed"
LIMITS = MatingLimits()


def mating(me: bytes, limits: MatingLimits = LIMITS, incarnation: int = 1) -> MatingStateMachine:
    """Return a robot's mating at its start."""
    return MatingStateMachine(me, incarnation, SCHEMA, limits)


def meets(
    robot: MatingStateMachine, peer: bytes, own: Offer, now_s: float = 0.0, nonce: int = NONCE
) -> list[Effect]:
    """Report a contact."""
    return robot.handle_contact(now_s, peer, nonce, own, TICK)


def hears(robot: MatingStateMachine, message: MatingMessage, now_s: float = 0.1) -> list[Effect]:
    """Let a robot receive a message."""
    return robot.handle_message(now_s, message, LETTER)


def says(effects: Iterable[Effect]) -> list[MatingMessage]:
    """Return what is said, in order, and check that it is said to its receiver."""
    sent = [effect for effect in effects if isinstance(effect, Send)]
    assert all(effect.to == receiver_of(effect.message) for effect in sent)
    return [effect.message for effect in sent]


def writes(effects: Iterable[Effect]) -> list[str]:
    """Return the states of what is written, in order."""
    return [r.state for effect in effects if isinstance(effect, Write) for r in effect.records]


def notes(effects: Iterable[Effect]) -> list[str]:
    """Return what observers are told."""
    return [effect.outcome for effect in effects if isinstance(effect, OutcomeReport)]


def only_write(effects: Iterable[Effect]) -> Write:
    """Return the one write among effects."""
    (write,) = (effect for effect in effects if isinstance(effect, Write))
    return write


def encounter(
    initiator: bytes, responder: bytes, count: int = 1, incarnation: int = 1
) -> Encounter:
    """Return the name of an encounter."""
    return Encounter(initiator, responder, incarnation, count)


AB = encounter(A, B)
PROPOSE = Propose(AB, NONCE, SCHEMA, OF_A.agent, OF_A.genes)
ACCEPT = Accept(AB, NONCE, SCHEMA, OF_B.agent, OF_B.genes)
BA = encounter(B, A)
COUNTER = Propose(BA, NONCE, SCHEMA, OF_B.agent, OF_B.genes)


def proposed() -> MatingStateMachine:
    """Return A, which has proposed to B."""
    robot = mating(A)
    meets(robot, B, OF_A)
    return robot


def decided() -> MatingStateMachine:
    """Return A, which has decided to mate with B."""
    robot = proposed()
    hears(robot, ACCEPT)
    return robot


def prepared() -> MatingStateMachine:
    """Return B, which is prepared to mate with A."""
    robot = mating(B)
    meets(robot, A, OF_B)
    hears(robot, PROPOSE)
    return robot


def states(robot: MatingStateMachine) -> list[str]:
    """Return the states of a robot's open encounters."""
    return [record.state for record in robot.open]


class TestInitiator:
    """The robot that proposes, and decides."""

    def test_a_contact_makes_the_smaller_id_propose_at_once(self) -> None:
        """With its agent and genes, the nonce of the contact, and its next number; nothing goes to disk."""
        robot = mating(A)
        assert meets(robot, B, OF_A) == [Send(B, PROPOSE)]
        assert states(robot) == ["proposed"]

    def test_accept_decides_and_commits(self) -> None:
        """The decision, with the partner's genes and signed letter, is written before Commit is said."""
        robot = proposed()
        write, note, send = hears(robot, ACCEPT)
        assert isinstance(write, Write)
        assert write.decided == write.records[0]
        assert write.decided.partner == OF_B
        assert write.decided.own == OF_A
        assert (write.decided.proof, write.decided.nonce, write.decided.tick) == (
            LETTER, NONCE, TICK,
        )  # fmt: skip
        assert isinstance(note, OutcomeReport)
        assert note.outcome == "mated"
        assert send == Send(B, Commit(AB))
        assert states(robot) == ["decided"]

    def test_refuse_ends_a_proposal(self) -> None:
        """The reason is noted."""
        robot = proposed()
        (note,) = hears(robot, Refuse(AB, "busy"))
        assert note == OutcomeReport("refused", B, AB, "busy")
        assert states(robot) == []

    def test_a_proposal_without_an_answer_is_given_up(self) -> None:
        """The partner is told, in case it is prepared."""
        robot = proposed()
        effects = robot.handle_timeouts(LIMITS.propose_s)
        assert says(effects) == [Abort(AB)]
        assert notes(effects) == ["expired"]
        assert states(robot) == []

    def test_a_proposal_is_said_again_ever_less_often(self) -> None:
        """After retry_s, then after twice as long each time."""
        robot = proposed()
        times = []
        while robot.next_s < LIMITS.propose_s:
            now_s = robot.next_s
            if says(robot.handle_timeouts(now_s)) == [PROPOSE]:
                times.append(round(now_s, 3))
        assert times == [0.2, 0.6, 1.4]

    def test_a_decision_is_said_again_until_it_is_acknowledged(self) -> None:
        """At an Accept that comes again, and at every reminder."""
        robot = decided()
        assert says(hears(robot, ACCEPT)) == [Commit(AB)]
        assert says(robot.handle_timeouts(robot.next_s)) == [Commit(AB)]
        assert writes(hears(robot, Done(AB))) == ["mated"]
        assert states(robot) == []
        assert robot.next_s == float("inf")

    def test_done_decides_nothing(self) -> None:
        """Offspring were decided about with the decision, not with its acknowledgement."""
        assert only_write(hears(decided(), Done(AB))).decided is None

    def test_a_decision_without_acknowledgement_is_orphaned_and_kept(self) -> None:
        """It is written as such, once, is said seldom from then on, and is resolved if the partner returns."""
        robot = decided()
        effects = robot.handle_timeouts(0.1 + LIMITS.orphan_s)
        assert notes(effects) == ["orphaned"]
        assert only_write(effects).records[0].orphaned
        assert only_write(effects).decided is None
        assert robot.next_s == pytest.approx(0.1 + LIMITS.orphan_s + LIMITS.max_retry_s)
        assert says(robot.handle_timeouts(robot.next_s)) == [Commit(AB)]
        assert writes(robot.give_up(1e9, AB)) == []
        effects = hears(robot, Done(AB))
        assert writes(effects) == ["mated"]
        assert notes(effects) == ["resolved"]

    def test_an_unknown_encounter_is_aborted(self) -> None:
        """A robot that crashed before it decided does not know its old proposals: presumed abort."""
        robot = mating(A, incarnation=2)
        assert says(hears(robot, ACCEPT)) == [Abort(AB)]

    def test_an_encounter_of_the_future_is_not_answered(self) -> None:
        """This robot has never proposed it, so the letter is not even worth verifying."""
        robot = mating(A)
        assert not robot.expects(ACCEPT)
        assert hears(robot, ACCEPT) == []

    def test_an_accept_for_another_contact_or_schema_decides_nothing(self) -> None:
        """The nonce and the schema of the answer are those of the proposal."""
        robot = proposed()
        for accept in (
            Accept(AB, NONCE + 1, SCHEMA, OF_B.agent, OF_B.genes),
            Accept(AB, NONCE, OTHER_SCHEMA, OF_B.agent, OF_B.genes),
        ):
            assert hears(robot, accept) == []
        assert states(robot) == ["proposed"]

    def test_refuse_and_abort_do_not_touch_a_decision(self) -> None:
        """A copy of the proposal may have been refused before another was accepted."""
        robot = decided()
        assert hears(robot, Refuse(AB, "stale")) == []
        assert hears(robot, Abort(AB)) == []
        assert states(robot) == ["decided"]


class TestResponder:
    """The robot that prepares, and then waits for the decision."""

    def test_a_proposal_after_a_contact_prepares(self) -> None:
        """Both offers and the signed letter are written before Accept is said; nothing is decided yet."""
        robot = mating(B)
        meets(robot, A, OF_B)
        effects = hears(robot, PROPOSE)
        write = only_write(effects)
        assert write.decided is None
        assert write.records == (
            EncounterRecord(AB, "responder", "prepared", NONCE, TICK, OF_B, OF_A, LETTER),
        )
        assert effects.index(write) < effects.index(Send(A, ACCEPT))
        assert says(effects) == [ACCEPT]

    def test_a_proposal_without_a_contact_is_ignored(self) -> None:
        """Not met, met another, or met at another time: the nonce ties the letter to the meeting."""
        robot = mating(B)
        assert hears(robot, PROPOSE) == []
        meets(robot, C, OF_B)
        assert hears(robot, PROPOSE) == []
        meets(robot, A, OF_B, nonce=NONCE + 1)
        assert not robot.expects(PROPOSE)
        assert hears(robot, PROPOSE) == []

    def test_a_proposal_again_is_accepted_again(self) -> None:
        """With the same words; nothing is written twice."""
        robot = prepared()
        assert hears(robot, PROPOSE) == [Send(A, ACCEPT)]

    def test_an_old_proposal_is_stale(self) -> None:
        """Even if the same contact is reported again."""
        robot = prepared()
        hears(robot, Abort(AB))
        meets(robot, A, OF_B)
        assert says(hears(robot, PROPOSE)) == [Refuse(AB, "stale")]

    def test_a_newer_proposal_of_the_same_robot_replaces_an_older(self) -> None:
        """It would not propose again if it had decided the older; both are written in one transaction."""
        robot = prepared()
        meets(robot, A, OF_B, nonce=8)
        newer = Propose(encounter(A, B, 2), 8, SCHEMA, OF_A.agent, OF_A.genes)
        effects = hears(robot, newer)
        write = only_write(effects)
        assert [(r.encounter.count, r.state) for r in write.records] == [
            (1, "aborted"),
            (2, "prepared"),
        ]
        assert notes(effects) == ["aborted"]
        assert [m.encounter.count for m in says(effects)] == [2]
        assert [record.encounter.count for record in robot.open] == [2]

    def test_commit_mates_and_is_acknowledged(self) -> None:
        """The mating is written, and offspring decided about, before Done is said."""
        effects = hears(prepared(), Commit(AB))
        write = only_write(effects)
        assert write.decided == write.records[0]
        assert write.decided.partner == OF_A
        assert notes(effects) == ["mated"]
        assert effects[-1] == Send(A, Done(AB))

    def test_commit_again_is_acknowledged_again(self) -> None:
        """Without another decision, also after a crash."""
        robot = prepared()
        hears(robot, Commit(AB))
        assert hears(robot, Commit(AB)) == [Send(A, Done(AB))]
        restarted = mating(B, incarnation=2)
        restarted.restore(0.0, [], {A: (AB.number, True)})
        assert hears(restarted, Commit(AB)) == [Send(A, Done(AB))]

    def test_commit_of_an_unknown_encounter_is_ignored(self) -> None:
        """Or of one that was aborted."""
        assert hears(mating(B), Commit(AB)) == []
        robot = prepared()
        hears(robot, Abort(AB))
        assert hears(robot, Commit(AB)) == []

    def test_abort_ends_it(self) -> None:
        """And is written, so that the number is never accepted again."""
        robot = prepared()
        effects = hears(robot, Abort(AB))
        assert writes(effects) == ["aborted"]
        assert notes(effects) == ["aborted"]
        assert states(robot) == []

    def test_in_doubt_it_asks_and_is_free_for_others(self) -> None:
        """After doubt_s it says Accept again, counts a doubt once, and answers other robots meanwhile."""
        robot = prepared()
        assert robot.is_engaged
        effects = robot.handle_timeouts(robot.next_s)
        assert says(effects) == [ACCEPT]
        assert notes(effects) == ["doubt"]
        assert robot.doubts == 1
        assert not robot.is_engaged
        assert notes(robot.handle_timeouts(robot.next_s)) == []
        assert len(says(meets(robot, C, OF_B))) == 1
        effects = hears(robot, Commit(AB))
        assert notes(effects) == ["mated", "resolved"]
        assert robot.doubts == 0

    def test_in_doubt_it_answers_others(self) -> None:
        """A third robot's proposal is accepted while the first mating waits for its end."""
        robot = mating(C)
        meets(robot, A, OF_C)
        first = Propose(encounter(A, C), NONCE, SCHEMA, OF_A.agent, OF_A.genes)
        hears(robot, first)
        robot.handle_timeouts(robot.next_s)
        meets(robot, B, OF_C, now_s=0.7, nonce=9)
        second = Propose(encounter(B, C), 9, SCHEMA, OF_B.agent, OF_B.genes)
        assert writes(hears(robot, second, 0.8)) == ["prepared"]
        assert notes(hears(robot, Abort(first.encounter), 0.9)) == ["aborted", "resolved"]
        assert states(robot) == ["prepared"]

    def test_an_initiator_that_stays_away_makes_it_an_orphan(self) -> None:
        """It is kept, asks seldom, and is resolved if the initiator returns after all."""
        robot = prepared()
        hears(robot, PROPOSE)
        effects = robot.handle_timeouts(0.1 + LIMITS.orphan_s)
        assert notes(effects) == ["orphaned"]
        assert only_write(effects).records[0].orphaned
        assert robot.next_s == pytest.approx(0.1 + LIMITS.orphan_s + LIMITS.max_retry_s)
        assert says(robot.handle_timeouts(robot.next_s)) == [ACCEPT]
        assert robot.doubts == 1
        effects = hears(robot, Abort(AB))
        assert writes(effects) == ["aborted"]
        assert notes(effects) == ["aborted", "resolved"]

    def test_another_schema_is_refused(self) -> None:
        """Robots of another species do not mate."""
        robot = mating(B)
        meets(robot, A, OF_B)
        proposal = Propose(AB, NONCE, OTHER_SCHEMA, OF_A.agent, OF_A.genes)
        effects = hears(robot, proposal)
        assert says(effects) == [Refuse(AB, "schema")]
        assert notes(effects) == ["refused"]
        assert robot.open == ()


class TestCrossedProposals:
    """Both robots propose: the smaller id remains the initiator."""

    def both_have_proposed(self) -> tuple[MatingStateMachine, MatingStateMachine]:
        """Return A and B after each has proposed to the other."""
        a, b = mating(A), mating(B)
        meets(b, A, OF_B)
        assert says(b.handle_timeouts(LIMITS.patience_s)) == [COUNTER]
        meets(a, B, OF_A)
        return a, b

    def test_the_larger_id_waits_before_it_proposes(self) -> None:
        """For patience_s; a proposal of the other that comes before is simply accepted."""
        robot = mating(B)
        assert meets(robot, A, OF_B) == []
        assert robot.next_s == LIMITS.patience_s
        assert robot.handle_timeouts(LIMITS.patience_s - 0.01) == []
        assert says(hears(robot, PROPOSE)) == [ACCEPT]

    def test_the_larger_id_yields(self) -> None:
        """It forgets its own proposal, and offers the same agent as the responder."""
        _, b = self.both_have_proposed()
        assert says(hears(b, PROPOSE)) == [ACCEPT]
        assert [(r.role, r.own) for r in b.open] == [("responder", OF_B)]

    def test_the_smaller_id_does_not(self) -> None:
        """It waits until the other has heard of its proposal."""
        a, _ = self.both_have_proposed()
        assert hears(a, COUNTER) == []
        assert states(a) == ["proposed"]

    def test_whoever_has_proposed_already_lets_the_other_decide_nothing(self) -> None:
        """One contact, one mating: the yielded proposal is aborted if it is accepted after all."""
        _, b = self.both_have_proposed()
        hears(b, PROPOSE)
        accept = Accept(BA, NONCE, SCHEMA, OF_A.agent, OF_A.genes)
        assert says(hears(b, accept)) == [Abort(BA)]
        assert states(b) == ["prepared"]

    def test_a_smaller_id_that_is_engaged_refuses(self) -> None:
        """And proposes itself as soon as it is free, for the contact is still young."""
        a = mating(A)
        meets(a, C, OF_A, nonce=9)
        assert meets(a, B, OF_A) == []
        assert says(hears(a, COUNTER)) == [Refuse(BA, "busy")]
        (proposal,) = says(hears(a, Refuse(encounter(A, C), "busy")))
        assert proposal.encounter == encounter(A, B, 2)

    def test_it_offers_the_agent_of_the_newer_contact_if_that_is_meant(self) -> None:
        """The robots met again before their proposals crossed: the nonce tells which agent is asked for."""
        b = mating(B)
        meets(b, A, OF_B)
        b.handle_timeouts(LIMITS.patience_s)
        newer = Offer("ben", b"bencoded")
        meets(b, A, newer, now_s=1.0, nonce=8)
        (accept,) = says(hears(b, Propose(AB, 8, SCHEMA, OF_A.agent, OF_A.genes)))
        assert isinstance(accept, Accept)
        assert (accept.agent, accept.nonce) == ("ben", 8)


class TestThreeRobots:
    """A robot is engaged with one other at a time."""

    def test_an_engaged_robot_refuses_a_third(self) -> None:
        """As long as it waits for a decision, or for an answer to its own proposal."""
        for robot in (prepared(), self.b_proposed_to_d()):
            meets(robot, C, OF_B, nonce=9)
            proposal = Propose(encounter(C, B), 9, SCHEMA, OF_C.agent, OF_C.genes)
            effects = hears(robot, proposal)
            assert says(effects) == [Refuse(encounter(C, B), "busy")]
            assert notes(effects) == ["busy"]

    def b_proposed_to_d(self) -> MatingStateMachine:
        """Return B, which has proposed to D."""
        robot = mating(B)
        meets(robot, D, OF_B)
        return robot

    def test_an_engaged_robot_proposes_to_a_third_when_it_is_free(self) -> None:
        """The contact is remembered as long as it is young."""
        robot = proposed()
        assert meets(robot, C, OF_A, nonce=9) == []
        *_, proposal = says(hears(robot, ACCEPT, 0.2))
        assert isinstance(proposal, Propose)
        assert proposal.encounter == encounter(A, C, 2)
        assert proposal.nonce == 9

    def test_the_robot_met_last_comes_first(self) -> None:
        """It is the one most likely to be still there."""
        robot = proposed()
        meets(robot, C, OF_A, nonce=8)
        meets(robot, D, OF_A, nonce=9)
        (proposal,) = says(hears(robot, Refuse(AB, "busy")))
        assert receiver_of(proposal) == D

    def test_a_decided_encounter_engages_nobody(self) -> None:
        """Its partner's acknowledgement may take as long as it likes."""
        robot = decided()
        assert not robot.is_engaged
        assert len(says(meets(robot, C, OF_A, nonce=9))) == 1

    def test_nothing_new_begins_with_a_robot_that_has_not_acknowledged(self) -> None:
        """Or it would take the new proposal as a sign that the old was not decided."""
        robot = decided()
        assert says(meets(robot, B, OF_A, now_s=0.2, nonce=9)) == [Commit(AB)]
        proposal = Propose(BA, 9, SCHEMA, OF_B.agent, OF_B.genes)
        assert says(hears(robot, proposal)) == [Refuse(BA, "busy")]
        meets(robot, B, OF_A, now_s=0.3, nonce=10)
        hears(robot, Done(AB), 0.4)
        assert robot.next_s <= 0.4
        (proposal_now,) = says(robot.handle_timeouts(0.4))
        assert proposal_now.encounter == encounter(A, B, 2)

    def test_letters_to_others_and_from_itself_are_ignored(self) -> None:
        """Nor is a robot its own partner."""
        robot = mating(C)
        meets(robot, A, OF_C)
        assert not robot.expects(PROPOSE)
        myself = Propose(encounter(C, C), NONCE, SCHEMA, "me", bytes(8))
        assert not robot.expects(myself)
        assert hears(robot, PROPOSE) + hears(robot, myself) == []


class TestTimeAndPlace:
    """Contacts, absence, and when to look at the clock."""

    def test_a_contact_expires(self) -> None:
        """After contact_s no mating comes of it."""
        robot = mating(B)
        meets(robot, A, OF_B)
        assert robot.is_pending
        assert robot.handle_timeouts(LIMITS.contact_s) == []
        assert not robot.is_pending
        assert hears(robot, PROPOSE, LIMITS.contact_s) == []

    def test_a_hand_over_is_none_of_its_business(self) -> None:
        """The agent of the contact mates, whoever is in control when the letters arrive."""
        robot = mating(B)
        meets(robot, A, OF_B)
        offers = [r.own for r in only_write(hears(robot, PROPOSE, 1.9)).records]
        assert offers == [OF_B]
        assert says(robot.retry(50.0, AB)) == [ACCEPT]
        mated = only_write(hears(robot, Commit(AB), 99.0)).decided
        assert mated is not None
        assert mated.own == OF_B

    def test_a_partner_that_is_gone_frees_a_robot(self) -> None:
        """A proposal is given up, a contact forgotten; what is prepared stays, in doubt."""
        effects = (robot := proposed()).handle_peer_offline(0.1, B)
        assert says(effects) == [Abort(AB)]
        assert robot.open == ()
        effects = (robot := prepared()).handle_peer_offline(0.2, A)
        assert notes(effects) == ["doubt"]
        assert not robot.is_engaged
        assert states(robot) == ["prepared"]
        robot = prepared()
        assert robot.handle_peer_offline(0.2, C) == []
        assert robot.is_engaged
        robot = mating(B)
        meets(robot, A, OF_B)
        assert robot.handle_peer_offline(0.1, A) == []
        assert not robot.is_pending

    def test_a_partner_that_is_back_is_reminded_at_once(self) -> None:
        """Whatever its absence left open; others are not."""
        robot = decided()
        assert says(robot.handle_peer_online(9.0, B)) == [Commit(AB)]
        assert robot.handle_peer_online(9.0, C) == []

    def test_it_says_when_to_look_at_the_clock(self) -> None:
        """Nothing due: never. A contact: when patience or the contact ends. An encounter: the reminder."""
        robot = mating(B)
        assert robot.next_s == float("inf")
        meets(robot, A, OF_B, now_s=1.0)
        assert robot.next_s == 1.0 + LIMITS.patience_s
        hears(robot, PROPOSE, 1.1)
        assert robot.next_s == pytest.approx(1.1 + LIMITS.doubt_s)

    def test_it_never_asks_to_look_at_the_clock_in_vain(self) -> None:
        """A contact whose robot has an encounter open is not due: only its end is."""
        robot = decided()
        meets(robot, B, OF_A, now_s=0.2, nonce=9)
        for _ in range(100):
            before = robot.next_s
            robot.handle_timeouts(before)
            assert robot.next_s > before

    def test_a_contact_of_which_nothing_can_come_is_due_when_it_ends(self) -> None:
        """So that lockstep does not wait for it any longer."""
        robot = mating(A, MatingLimits(open=0))
        assert meets(robot, B, OF_A) == []
        assert robot.next_s == LIMITS.contact_s
        robot.handle_timeouts(robot.next_s)
        assert not robot.is_pending

    def test_a_copy_goes_its_own_way(self) -> None:
        """What happens to it does not happen to the original."""
        robot = proposed()
        other = robot.copy()
        hears(other, ACCEPT)
        assert states(robot) == ["proposed"]
        assert states(other) == ["decided"]


class TestLimits:
    """No peer can make a robot remember without bound."""

    def test_with_too_many_open_encounters_there_are_no_new_ones(self) -> None:
        """It neither proposes nor accepts, and does what it has."""
        robot = mating(B, MatingLimits(open=1))
        meets(robot, A, OF_B)
        hears(robot, PROPOSE)
        robot.handle_timeouts(LIMITS.doubt_s + 0.1)
        assert meets(robot, D, OF_B, now_s=0.7, nonce=9) == []
        meets(robot, C, OF_B, now_s=0.7, nonce=9)
        proposal = Propose(encounter(C, B), 9, SCHEMA, OF_C.agent, OF_C.genes)
        assert says(hears(robot, proposal, 0.8)) == [Refuse(encounter(C, B), "busy")]
        effects = hears(robot, Abort(AB), 0.9)
        assert [receiver_of(message) for message in says(effects)] == [C]

    def test_with_too_many_peers_strangers_are_refused(self) -> None:
        """The number of one's last encounter is never forgotten, so there is no room for another's."""
        robot = mating(C, MatingLimits(peers=1))
        meets(robot, A, OF_C)
        first = Propose(encounter(A, C), NONCE, SCHEMA, OF_A.agent, OF_A.genes)
        hears(robot, first)
        hears(robot, Commit(first.encounter))
        meets(robot, B, OF_C, now_s=0.2, nonce=9)
        stranger = Propose(encounter(B, C), 9, SCHEMA, OF_B.agent, OF_B.genes)
        assert says(hears(robot, stranger, 0.3)) == [Refuse(stranger.encounter, "busy")]
        meets(robot, A, OF_C, now_s=0.4, nonce=10)
        known = Propose(encounter(A, C, 2), 10, SCHEMA, OF_A.agent, OF_A.genes)
        assert isinstance(says(hears(robot, known, 0.5))[0], Accept)


class TestDisk:
    """What a disk refuses has not happened; what it holds is taken up again."""

    def test_an_undone_preparation_is_refused(self) -> None:
        """The initiator is told so; a copy of its proposal is stale."""
        robot = mating(B)
        meets(robot, A, OF_B)
        write = only_write(hears(robot, PROPOSE))
        effects = robot.rollback(0.2, write)
        assert says(effects) == [Refuse(AB, "storage")]
        assert notes(effects) == ["storage"]
        assert robot.open == ()

    def test_an_undone_replacement_leaves_the_older(self) -> None:
        """Both or neither: the older encounter waits on."""
        robot = prepared()
        meets(robot, A, OF_B, nonce=8)
        newer = Propose(encounter(A, B, 2), 8, SCHEMA, OF_A.agent, OF_A.genes)
        effects = robot.rollback(0.3, only_write(hears(robot, newer)))
        assert says(effects) == [Refuse(newer.encounter, "storage")]
        assert [(r.encounter, r.state) for r in robot.open] == [(AB, "prepared")]

    def test_an_undone_decision_is_aborted(self) -> None:
        """It was never said."""
        robot = proposed()
        effects = robot.rollback(0.2, only_write(hears(robot, ACCEPT)))
        assert says(effects) == [Abort(AB)]
        assert robot.open == ()
        assert says(hears(robot, ACCEPT)) == [Abort(AB)]

    def test_an_undone_mating_can_still_take_place(self) -> None:
        """The responder stays prepared, the initiator says Commit again, and then the decision is made."""
        robot = prepared()
        robot.rollback(0.2, only_write(hears(robot, Commit(AB))))
        assert states(robot) == ["prepared"]
        effects = hears(robot, Commit(AB), 0.3)
        assert only_write(effects).decided is not None
        assert says(effects) == [Done(AB)]

    def test_an_undone_end_is_ended_later(self) -> None:
        """The initiator goes on saying Commit, and hears Done again."""
        robot = decided()
        robot.rollback(0.2, only_write(hears(robot, Done(AB))))
        assert says(robot.handle_timeouts(robot.next_s)) == [Commit(AB)]
        assert writes(hears(robot, Done(AB))) == ["mated"]

    def test_what_is_open_on_disk_is_taken_up_after_a_crash(self) -> None:
        """The initiator says what it decided, the responder asks; neither is engaged by it."""
        for before, word in ((decided(), Commit(AB)), (prepared(), ACCEPT)):
            robot = mating(before.me, incarnation=2)
            robot.restore(100.0, before.open, {})
            assert robot.open == before.open
            assert not robot.is_engaged
            assert robot.doubts == states(robot).count("prepared")
            assert says(robot.handle_timeouts(robot.next_s)) == [word]

    def test_an_orphan_on_disk_is_asked_for_seldom_after_a_crash(self) -> None:
        """It is not counted again."""
        (record,) = prepared().open
        robot = mating(B, incarnation=2)
        robot.restore(100.0, [replace(record, orphaned=True)], {})
        assert robot.next_s == 100.0 + LIMITS.max_retry_s
        assert notes(robot.handle_timeouts(1000.0)) == []

    def test_numbers_of_a_new_life_are_new(self) -> None:
        """A proposal after a crash is newer than any before."""
        robot = mating(A, incarnation=2)
        (proposal,) = says(meets(robot, B, OF_A))
        assert proposal.encounter.number == (2, 1)
        assert proposal.encounter.number > (1, 99)

    def test_marks_on_disk_make_old_proposals_stale_after_a_crash(self) -> None:
        """Whatever contact is reported."""
        robot = mating(B, incarnation=2)
        robot.restore(0.0, [], {A: ((1, 1), False)})
        meets(robot, A, OF_B)
        assert says(hears(robot, PROPOSE)) == [Refuse(AB, "stale")]
        assert hears(robot, Commit(AB)) == []
