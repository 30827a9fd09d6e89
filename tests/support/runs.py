"""Short runs for tests of recordings and dashboards, as folders and as samples."""

from collections.abc import Iterable, Sequence

import msgspec

from crcolony.evolution.history import Born, Died, Event, Lived, Mated, OwnEvent, TurnedOver
from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import EventMessage, Exchanged
from crcolony.telemetry.samples import EventSample, TelemetrySample

SEED = 10
"""Of a small colony in which every robot mates."""


def event_messages(samples: Iterable[TelemetrySample]) -> list[EventMessage]:
    return [sample.message for sample in samples if isinstance(sample, EventSample)]


def history_of(samples: Iterable[TelemetrySample], robots: Sequence[RobotId]) -> list[Event]:
    """Return the history in samples, with numbers for ids of robots; both sides of a mating are one event."""
    numbers = {robot.hex(): number for number, robot in enumerate(robots)}
    events: list[Event] = []
    sides: list[EventMessage] = []
    for message in event_messages(samples):
        if isinstance(message.event, Exchanged):
            sides.append(message)
            if len(sides) == 2:
                events.append(_mated(sides[0], sides[1], numbers))
                sides.clear()
        elif isinstance(message.event, Born | Died | Lived | TurnedOver):
            events.append(_with_robot_numbers(message.event, numbers))
    assert not sides
    return events


def _mated(one: EventMessage, other: EventMessage, numbers: dict[str, int]) -> Mated:
    own, partners = one.event, other.event
    assert isinstance(own, Exchanged)
    assert isinstance(partners, Exchanged)
    assert own.encounter == partners.encounter
    assert (own.agent, own.partner) == (partners.partner, partners.agent)
    return Mated(
        tick=own.tick,
        robot=numbers[one.robot.hex()],
        partner_robot=numbers[other.robot.hex()],
        agent=_agent_with_robot_number(own.agent, numbers),
        partner=_agent_with_robot_number(own.partner, numbers),
        energy=own.energy,
        partner_energy=partners.energy,
        conceived=own.conceived,
        partner_conceived=partners.conceived,
    )


def _with_robot_numbers(event: OwnEvent, numbers: dict[str, int]) -> OwnEvent:
    names = {
        field: _agent_with_robot_number(name, numbers)
        for field in ("agent", "mother", "father")
        if (name := getattr(event, field, None)) is not None
    }
    return msgspec.structs.replace(event, **names)


def _agent_with_robot_number(name: str, numbers: dict[str, int]) -> str:
    robot, _, own = name.partition("/")
    return f"{numbers.get(robot, robot)}/{own}"  # the mother of a founder is of another run
