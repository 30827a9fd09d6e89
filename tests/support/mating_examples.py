"""Robots, messages and shorthands for the examples of a mating. A < B < C < D are robots."""

from collections.abc import Iterable

from crcolony.protocol.encounters import Effect, MatingLimits, Offer, OutcomeReport, Send, Write
from crcolony.protocol.mating import MatingStateMachine
from crcolony.protocol.mating_messages import Accept, Encounter, MatingMessage, Propose, receiver_of

A, B, C, D = (name * 16 for name in (b"a", b"b", b"c", b"d"))
SCHEMA, OTHER_SCHEMA = bytes(16), bytes([1] * 16)
NONCE, TICK = 7, 5
OF_A, OF_B, OF_C = (Offer(name, name.encode() * 8) for name in ("ann", "bob", "cy"))
ENVELOPE = b"a signed envelope"
LIMITS = MatingLimits()


def mating(me: bytes, limits: MatingLimits = LIMITS, incarnation: int = 1) -> MatingStateMachine:
    """Return a robot's state machine at its start."""
    return MatingStateMachine(me, incarnation, SCHEMA, limits)


def report_contact(
    robot: MatingStateMachine, peer: bytes, own: Offer, now_s: float = 0.0, nonce: int = NONCE
) -> list[Effect]:
    """Let the robot's body report a contact."""
    return robot.handle_contact(now_s, peer, nonce, own, TICK)


def receive(robot: MatingStateMachine, message: MatingMessage, now_s: float = 0.1) -> list[Effect]:
    """Let a robot receive a message."""
    return robot.handle_message(now_s, message, ENVELOPE)


def messages(effects: Iterable[Effect]) -> list[MatingMessage]:
    """Return the messages that are sent, in order, and check their receivers."""
    sent = [effect for effect in effects if isinstance(effect, Send)]
    assert all(effect.to == receiver_of(effect.message) for effect in sent)
    return [effect.message for effect in sent]


def written_states(effects: Iterable[Effect]) -> list[str]:
    """Return the states of the records that are written, in order."""
    return [r.state for effect in effects if isinstance(effect, Write) for r in effect.records]


def outcomes(effects: Iterable[Effect]) -> list[str]:
    """Return the outcomes that are reported to observers."""
    return [effect.outcome for effect in effects if isinstance(effect, OutcomeReport)]


def only_write(effects: Iterable[Effect]) -> Write:
    """Return the one write among effects."""
    (write,) = (effect for effect in effects if isinstance(effect, Write))
    return write


def encounter(
    initiator: bytes, responder: bytes, count: int = 1, incarnation: int = 1
) -> Encounter:
    """Return an encounter by its number."""
    return Encounter(initiator, responder, incarnation, count)


AB = encounter(A, B)
PROPOSE = Propose(AB, NONCE, SCHEMA, OF_A.agent, OF_A.genes)
ACCEPT = Accept(AB, NONCE, SCHEMA, OF_B.agent, OF_B.genes)
BA = encounter(B, A)
COUNTER = Propose(BA, NONCE, SCHEMA, OF_B.agent, OF_B.genes)


def proposed() -> MatingStateMachine:
    """Return A, which has proposed to B."""
    robot = mating(A)
    report_contact(robot, B, OF_A)
    return robot


def decided() -> MatingStateMachine:
    """Return A, which has decided to mate with B."""
    robot = proposed()
    receive(robot, ACCEPT)
    return robot


def prepared() -> MatingStateMachine:
    """Return B, which is prepared to mate with A."""
    robot = mating(B)
    report_contact(robot, A, OF_B)
    receive(robot, PROPOSE)
    return robot


def states(robot: MatingStateMachine) -> list[str]:
    """Return the states of a robot's open encounters."""
    return [record.state for record in robot.open]
