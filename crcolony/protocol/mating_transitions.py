"""The transitions of a mating as data: the table of PROTOCOL.md, "Transitions".

Every row is about one encounter at one robot. Tests hold that `mating.py` takes these transitions and no others, and
that the table in PROTOCOL.md is this one.
"""

from typing import Literal, NamedTuple

from crcolony.protocol.encounters import EncounterState, Role

State = Literal["none"] | EncounterState
"""State of an encounter; `none` is one of which the robot keeps nothing."""

Event = Literal[
    "contact", "propose", "accept", "refuse", "commit", "abort", "done",
    "newer propose", "crossing propose", "retry", "timeout", "failed write",
]  # fmt: skip
"""What happens: a contact, a message about this encounter, a propose of another encounter, a timer, or a full disk.

A `newer propose` is one of the same initiator with a higher number. A `crossing propose` is one of the robot to which
this robot has proposed. A `failed write` finds the encounter in the state that the write should have persisted.
"""

Action = Literal[
    "write", "decide about offspring", "send propose", "send accept", "send commit", "send abort",
    "send done", "send refuse: busy", "send refuse: schema", "send refuse: stale",
    "send refuse: storage",
]  # fmt: skip
"""What a robot does. The decision about offspring is part of the write's transaction."""


class Transition(NamedTuple):
    """One row of the table: `actions` are carried out in their order, `condition` is for readers."""

    role: Role
    state: State
    event: Event
    next_state: State
    actions: tuple[Action, ...]
    condition: str = ""


TRANSITIONS = (
    Transition(
        "initiator", "none", "contact", "proposed", ("send propose",), "may propose (rules 1 to 3)"
    ),
    Transition("initiator", "proposed", "retry", "proposed", ("send propose",)),
    Transition(
        "initiator",
        "proposed",
        "accept",
        "decided",
        ("write", "decide about offspring", "send commit"),
        "nonce and schema are the proposal's",
    ),
    Transition("initiator", "proposed", "refuse", "none", ()),
    Transition(
        "initiator",
        "proposed",
        "timeout",
        "none",
        ("send abort",),
        "after `propose_s`, or when the responder goes offline",
    ),
    Transition(
        "initiator",
        "proposed",
        "crossing propose",
        "none",
        (),
        "the other robot's id is smaller: yield, and handle it as its responder",
    ),
    Transition("initiator", "decided", "accept", "decided", ("send commit",)),
    Transition("initiator", "decided", "retry", "decided", ("send commit",)),
    Transition("initiator", "decided", "done", "mated", ("write",)),
    Transition(
        "initiator",
        "decided",
        "timeout",
        "decided",
        ("write",),
        "once, after `orphan_s`: it is now *orphaned*, retries continue",
    ),
    Transition(
        "initiator",
        "none",
        "accept",
        "none",
        ("send abort",),
        "its number has been used (presumed abort)",
    ),
    Transition(
        "responder",
        "none",
        "propose",
        "prepared",
        ("write", "send accept"),
        "quotes the nonce of the own contact with the initiator",
    ),
    Transition(
        "responder",
        "none",
        "propose",
        "none",
        ("send refuse: busy",),
        "as above, but engaged, unresolved with this robot, or no room",
    ),
    Transition(
        "responder", "none", "propose", "none", ("send refuse: schema",), "of another schema"
    ),
    Transition(
        "responder",
        "none",
        "propose",
        "none",
        ("send refuse: stale",),
        "its number is not above the initiator's mark",
    ),
    Transition(
        "responder",
        "mated",
        "propose",
        "mated",
        ("send refuse: stale",),
        "its number is the initiator's mark",
    ),
    Transition("responder", "prepared", "propose", "prepared", ("send accept",)),
    Transition(
        "responder",
        "prepared",
        "newer propose",
        "aborted",
        ("write",),
        "in one transaction with the newer encounter",
    ),
    Transition(
        "responder",
        "prepared",
        "retry",
        "prepared",
        ("send accept",),
        "asks for the decision: it is now *in doubt*",
    ),
    Transition(
        "responder", "prepared", "commit", "mated", ("write", "decide about offspring", "send done")
    ),
    Transition("responder", "prepared", "abort", "aborted", ("write",)),
    Transition(
        "responder",
        "prepared",
        "timeout",
        "prepared",
        ("write",),
        "once, after `orphan_s`: it is now *orphaned*, retries continue",
    ),
    Transition(
        "responder",
        "mated",
        "commit",
        "mated",
        ("send done",),
        "the last mating with this initiator",
    ),
    Transition(
        "initiator", "decided", "failed write", "none", ("send abort",), "the write of the decision"
    ),
    Transition("initiator", "decided", "failed write", "decided", (), "the write of *orphaned*"),
    Transition("initiator", "mated", "failed write", "decided", ()),
    Transition(
        "responder",
        "prepared",
        "failed write",
        "none",
        ("send refuse: storage",),
        "the first write",
    ),
    Transition("responder", "prepared", "failed write", "prepared", (), "the write of *orphaned*"),
    Transition("responder", "mated", "failed write", "prepared", ()),
    Transition("responder", "aborted", "failed write", "prepared", ()),
)
