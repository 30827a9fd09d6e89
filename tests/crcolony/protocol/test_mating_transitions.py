"""The state machine takes every transition of the table and no other, and the check notices if it does not."""

from collections.abc import Callable, Iterable
from typing import Any

import pytest

from crcolony.protocol.mating import MatingStateMachine
from crcolony.protocol.mating_messages import (
    Abort,
    Commit,
    Done,
    Propose,
    Refuse,
)
from crcolony.protocol.mating_transitions import TRANSITIONS, Transition
from tests.support.explored_robot import Bounds, Caller
from tests.support.mating_examples import (
    AB,
    ACCEPT,
    BA,
    LIMITS,
    NONCE,
    OF_A,
    OF_B,
    OTHER_SCHEMA,
    PROPOSE,
    SCHEMA,
    A,
    B,
    C,
    encounter,
    only_write,
    receive,
    report_contact,
)
from tests.support.mating_explorer import explore
from tests.support.sabotaged_mating import (
    AcknowledgesSilently,
    GuessesAbort,
    IgnoresAbort,
    PresumesCommit,
)
from tests.support.transition_recorder import ROWS, record_transitions

Machine = type[MatingStateMachine]
Story = Callable[[Machine], None]


def robot(machine: Machine, me: bytes) -> MatingStateMachine:
    """Return robot A after a contact with B, which makes it propose, or B after a contact with A."""
    result = machine(me, 1, SCHEMA, LIMITS)
    report_contact(result, B if me == A else A, OF_A if me == A else OF_B)
    return result


def initiate(machine: Machine) -> None:
    """A proposes, retries, is accepted, retries, is orphaned and acknowledged; every write fails once."""
    a = robot(machine, A)
    a.retry(0.1, AB)
    receive(a, ACCEPT)
    receive(a, ACCEPT)
    a.retry(0.2, AB)
    a.rollback(0.3, only_write(a.give_up(0.3, AB)))
    a.give_up(0.4, AB)
    a.rollback(0.5, only_write(receive(a, Done(AB))))
    receive(a, Done(AB))
    receive(a, ACCEPT)
    a = robot(machine, A)
    a.rollback(0.1, only_write(receive(a, ACCEPT)))


def end_proposals(machine: Machine) -> None:
    """A proposal is refused, gives up, or yields to the proposal of a smaller id."""
    receive(robot(machine, A), Refuse(AB, "busy"))
    robot(machine, A).give_up(2.0, AB)
    b = robot(machine, B)
    b.handle_timeouts(LIMITS.patience_s)
    assert b.open[0].encounter == BA
    receive(b, PROPOSE)


def respond(machine: Machine) -> None:
    """B is prepared, retries, is orphaned, mates and acknowledges again; every write fails once."""
    b = robot(machine, B)
    receive(b, PROPOSE)
    receive(b, PROPOSE)
    b.retry(0.2, AB)
    b.rollback(0.3, only_write(b.give_up(0.3, AB)))
    b.give_up(0.4, AB)
    b.rollback(0.5, only_write(receive(b, Commit(AB))))
    receive(b, Commit(AB))
    receive(b, Commit(AB))
    report_contact(b, A, OF_B)
    receive(b, PROPOSE)
    b = robot(machine, B)
    b.rollback(0.1, only_write(receive(b, PROPOSE)))


def abort(machine: Machine) -> None:
    """B is prepared and receives an abort, once with a full disk, or a newer proposal; the old one is then stale."""
    b = robot(machine, B)
    receive(b, PROPOSE)
    b.rollback(0.2, only_write(receive(b, Abort(AB))))
    receive(b, Abort(AB))
    report_contact(b, A, OF_B)
    receive(b, PROPOSE)
    b = robot(machine, B)
    receive(b, PROPOSE)
    report_contact(b, A, OF_B, nonce=8)
    receive(b, Propose(encounter(A, B, 2), 8, SCHEMA, OF_A.agent, OF_A.genes))


def refuse(machine: Machine) -> None:
    """B refuses another species, and a robot that proposes while B is engaged."""
    receive(robot(machine, B), Propose(AB, NONCE, OTHER_SCHEMA, OF_A.agent, OF_A.genes))
    c = robot(machine, C)
    receive(c, Propose(encounter(A, C), NONCE, SCHEMA, OF_A.agent, OF_A.genes))
    report_contact(c, B, OF_B, nonce=9)
    receive(c, Propose(encounter(B, C), 9, SCHEMA, OF_B.agent, OF_B.genes))


STORIES: tuple[Story, ...] = (
    initiate,
    end_proposals,
    respond,
    abort,
    refuse,
)


def transitions_of(machine: Machine, stories: Iterable[Story] = STORIES) -> set[Transition]:
    """Return the transitions that a state machine takes in stories."""
    recording, taken = record_transitions(machine)
    for story in stories:
        story(recording)
    return taken


def row_name(row: Transition) -> str:
    """Return a name for a row of the table."""
    return " ".join((row.role, row.state, row.event, *row.actions)).replace(" ", "_")


class TestTable:
    """`mating_transitions.py` describes `mating.py`."""

    @pytest.mark.parametrize("row", TRANSITIONS, ids=row_name)
    def test_the_machine_takes_every_transition_of_the_table(self, row: Transition) -> None:
        """Each row is exercised by one of the stories above."""
        assert row._replace(condition="") in transitions_of(MatingStateMachine)

    def test_the_machine_takes_no_other_transition(self) -> None:
        """Whatever the stories make it do is a row."""
        assert transitions_of(MatingStateMachine) <= ROWS

    def test_no_transition_outside_the_table_is_ever_reached(self) -> None:
        """Two robots meet once or twice, with a crash, a full disk or a repeated contact, in every order of events."""
        caller = Caller()
        caller.mating, taken = record_transitions()
        pair = (0, 1)
        for bounds in (
            Bounds((pair,), crashes=1, failed_writes=1, repeats=1),
            Bounds((pair, pair), failed_writes=1),
        ):
            assert explore(bounds, caller).violation is None
        assert taken <= ROWS
        (not_reached,) = ROWS - taken  # explored robots are of one species
        assert not_reached.actions == ("send refuse: schema",)

    def test_no_row_is_there_twice(self) -> None:
        """A condition alone does not make a row."""
        assert len(ROWS) == len(TRANSITIONS)


def wait_too_long(machine: Machine) -> None:
    """B is prepared and gives up."""
    b = robot(machine, B)
    receive(b, PROPOSE)
    b.give_up(60.0, AB)


def prepare_and_abort(machine: Machine) -> None:
    """B is prepared and receives an abort."""
    b = robot(machine, B)
    receive(b, PROPOSE)
    receive(b, Abort(AB))


class TestSabotage:
    """The check fails for a machine that differs from the table in one row."""

    @pytest.mark.parametrize(
        ("machine", "story", "transition"),
        [
            (PresumesCommit, initiate, ("initiator", "none", "accept", "none", ("send commit",))),
            (
                AcknowledgesSilently,
                respond,
                ("responder", "prepared", "commit", "mated", ("write", "decide about offspring")),
            ),
            (
                GuessesAbort,
                wait_too_long,
                ("responder", "prepared", "timeout", "aborted", ("write",)),
            ),
        ],
    )
    def test_a_wrong_transition_is_noticed(
        self, machine: Machine, story: Story, transition: tuple[Any, ...]
    ) -> None:
        """The recorder names the transition that is no row."""
        assert transitions_of(machine, [story]) - ROWS >= {Transition(*transition)}
        assert transitions_of(MatingStateMachine, [story]) <= ROWS

    def test_a_missing_transition_is_noticed(self) -> None:
        """The row is then exercised by no story."""
        row = Transition("responder", "prepared", "abort", "aborted", ("write",))
        assert row in transitions_of(MatingStateMachine, [prepare_and_abort])
        assert row not in transitions_of(IgnoresAbort, [prepare_and_abort])

    def test_a_row_taken_out_of_the_table_is_noticed(self) -> None:
        """Every row is needed."""
        taken = transitions_of(MatingStateMachine)
        for row in ROWS:
            assert not taken <= ROWS - {row}
