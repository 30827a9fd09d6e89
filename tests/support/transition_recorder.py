"""Records the transitions that a mating state machine takes, in the terms of `mating_transitions.py`.

It compares the state before and after every event and reads the effects; it knows nothing of the machine's decisions.
`python -m tests.support.transition_recorder` prints the table for PROTOCOL.md.
"""

from collections.abc import Iterable
from typing import cast, get_args

from crcolony.protocol.encounters import Effect, EncounterRecord, Role, Send, Write
from crcolony.protocol.mating import MatingStateMachine
from crcolony.protocol.mating_messages import Encounter, MatingMessage, Propose, Refuse
from crcolony.protocol.mating_transitions import TRANSITIONS, Action, Event, State, Transition

ROWS = frozenset(row._replace(condition="") for row in TRANSITIONS)
"""The rows of the table without what is for readers only."""


class RecordingStateMachine(MatingStateMachine):
    """A state machine that records every transition it takes; a class of it shares one record."""

    taken: set[Transition]

    def handle_message(self, now_s: float, message: MatingMessage, envelope: bytes) -> list[Effect]:
        state = self._state_of(message.encounter)
        others = [record for record in self.open if record.encounter != message.encounter]
        effects = super().handle_message(now_s, message, envelope)
        self._record(message.encounter, state, cast(Event, tag_of(message)), effects)
        for record in others if isinstance(message, Propose) else ():
            if record.peer == message.encounter.initiator:
                event: Event = "crossing propose" if record.state == "proposed" else "newer propose"
                self._record(record.encounter, record.state, event, effects)
        return effects

    def retry(self, now_s: float, encounter: Encounter) -> list[Effect]:
        state = self._state_of(encounter)
        effects = super().retry(now_s, encounter)
        self._record(encounter, state, "retry", effects)
        return effects

    def give_up(self, now_s: float, encounter: Encounter) -> list[Effect]:
        state = self._state_of(encounter)
        effects = super().give_up(now_s, encounter)
        self._record(encounter, state, "timeout", effects)
        return effects

    def rollback(self, now_s: float, write: Write) -> list[Effect]:
        effects = super().rollback(now_s, write)
        for record in write.records:
            self._record(record.encounter, record.state, "failed write", effects, is_certain=True)
        return effects

    def _propose_due(self, now_s: float) -> list[Effect]:
        known = {record.encounter for record in self.open}
        effects = super()._propose_due(now_s)
        for record in self.open:
            if record.encounter not in known:
                self._record(record.encounter, "none", "contact", effects)
        return effects

    def _state_of(self, encounter: Encounter) -> State:
        entry = self._open.get(encounter)
        if entry is not None:
            return entry.record.state
        is_mated = encounter.initiator != self.me and self._marks.is_mated(encounter)
        return "mated" if is_mated else "none"

    def _record(
        self,
        encounter: Encounter,
        state: State,
        event: Event,
        effects: list[Effect],
        is_certain: bool = False,
    ) -> None:
        """Add a transition; an event that changes nothing and has no effect is ignored, unless `is_certain`."""
        role: Role = "initiator" if encounter.initiator == self.me else "responder"
        written = [record.state for record in written_records(effects, encounter)]
        next_state = written[-1] if written else self._state_of(encounter)
        actions = actions_on(encounter, effects)
        if actions or next_state != state or is_certain:
            self.taken.add(Transition(role, state, event, next_state, actions))


def record_transitions(
    machine: type[MatingStateMachine] = MatingStateMachine,
) -> tuple[type[MatingStateMachine], set[Transition]]:
    """Return a recording variant of a state machine, and the set into which it records."""
    taken: set[Transition] = set()
    variant = type("Recording", (RecordingStateMachine, machine), {"taken": taken})
    return cast(type[MatingStateMachine], variant), taken


def written_records(effects: Iterable[Effect], encounter: Encounter) -> list[EncounterRecord]:
    """Return the records of an encounter that effects write."""
    writes = (effect for effect in effects if isinstance(effect, Write))
    return [r for write in writes for r in write.records if r.encounter == encounter]


def actions_on(encounter: Encounter, effects: Iterable[Effect]) -> tuple[Action, ...]:
    """Return the actions of effects that concern an encounter, in their order."""
    actions: list[str] = []
    for effect in effects:
        match effect:
            case Write() if written_records([effect], encounter):
                actions.append("write")
                if effect.decided and effect.decided.encounter == encounter:
                    actions.append("decide about offspring")
            case Send(message=message) if message.encounter == encounter:
                reason = f": {message.reason}" if isinstance(message, Refuse) else ""
                actions.append(f"send {tag_of(message)}{reason}")
    assert set(actions) <= set(get_args(Action)), actions
    return tuple(cast(list[Action], actions))


def tag_of(message: MatingMessage) -> str:
    """Return the name of a message on the wire."""
    return str(message.__struct_config__.tag)


def format_table() -> str:
    """Return the table of transitions as it stands in PROTOCOL.md."""
    lines = [
        "| role | state | event | condition | next state | actions |",
        "|---|---|---|---|---|---|",
    ]
    for row in TRANSITIONS:
        states = ["(none)" if s == "none" else s.upper() for s in (row.state, row.next_state)]
        cells = (row.role, states[0], row.event, row.condition, states[1], "; ".join(row.actions))
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(line.replace("|  |", "| |") for line in lines)


if __name__ == "__main__":
    print(format_table())
