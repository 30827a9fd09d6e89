"""Short runs for tests of dashboards, as folders and as what is heard of them."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import msgspec

from crcolony.config import Config
from crcolony.evolution.history import Born, Died, Event, Lived, Mated, OwnEvent, TurnedOver
from crcolony.in_process.run import run_until_done, start_run
from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import EventMessage, Exchanged, decode_event
from crcolony.results.run_folder import RunFolder
from crcolony.telemetry.colony_monitor import TelemetrySample


def run(folder: Path, config: Config, stop_after: int = 10**9) -> RunFolder:
    """Run an embedded colony until its end, or until it was looked at `stop_after` times."""
    results, colony = start_run(folder, config)
    looks = iter(range(stop_after))
    run_until_done(results, colony, lambda: next(looks, None) is None, lambda _: None)
    results.close()
    return results


def told_in(sample: Iterable[TelemetrySample]) -> list[EventMessage]:
    return [decode_event(one.data) for one in sample if one.kind == "event"]


def history_in(sample: Iterable[TelemetrySample], robots: Sequence[RobotId]) -> list[Event]:
    """Return the history that robots tell of, called by their numbers again; both sides of a mating are one event."""
    numbers = {robot.hex(): number for number, robot in enumerate(robots)}
    events: list[Event] = []
    sides: list[EventMessage] = []
    for message in told_in(sample):
        if isinstance(message.event, Exchanged):
            sides.append(message)
            if len(sides) == 2:
                events.append(_mated(sides[0], sides[1], numbers))
                sides.clear()
        elif isinstance(message.event, Born | Died | Lived | TurnedOver):
            events.append(_renamed(message.event, numbers))
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
        agent=_by_number(own.agent, numbers),
        partner=_by_number(own.partner, numbers),
        energy=own.energy,
        partner_energy=partners.energy,
        conceived=own.conceived,
        partner_conceived=partners.conceived,
    )


def _renamed(event: OwnEvent, numbers: dict[str, int]) -> OwnEvent:
    names = {
        field: _by_number(name, numbers)
        for field in ("agent", "mother", "father")
        if (name := getattr(event, field, None)) is not None
    }
    return msgspec.structs.replace(event, **names)


def _by_number(name: str, numbers: dict[str, int]) -> str:
    robot, _, own = name.partition("/")
    return f"{numbers[robot]}/{own}"
