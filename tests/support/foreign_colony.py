"""A colony of our robots and of foreign ones (`tests/foreign`), as processes, and the ledger over both kinds' disks."""

import contextlib
import secrets
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import zenoh
from nacl.signing import SigningKey

from crcolony.protocol.encounters import Offer
from crcolony.protocol.identity import robot_id
from crcolony.protocol.mating_messages import Encounter
from crcolony.protocol.signed_telemetry import open_telemetry, purpose_of_robot
from crcolony.storage.reading import read_stored_robot
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import open_session
from tests.foreign.identity import id_of
from tests.foreign.records import Records
from tests.support.observer import StateReceived
from tests.support.process import Robot, wait_until
from tests.support.process_colony import Colony, View, colony

REST_STEPS = 5
"""As short as that of our robots in a busy colony."""


@dataclass(frozen=True)
class Side:
    """One robot's record of a mating that took place."""

    state: str
    own: Offer
    partner: Offer | None
    conceived: bool


Ledger = dict[Encounter, dict[bytes, Side]]
"""Of every mating both sides, by robot."""


@dataclass
class ForeignColony:
    """An arena, our robots and an observer; foreign robots are started one by one."""

    made: Colony
    view: View
    _refused_before: int = 0

    def start(
        self, name: str, *options: str, script: str = "robot", key: SigningKey | None = None
    ) -> Robot:
        """Start a foreign robot, in a folder of this name, with a key of its own or the given one."""
        folder = self.made.folder / name
        folder.mkdir(exist_ok=True)
        if key is not None:
            (folder / "key").write_text(f"{bytes(key).hex()}\n")
        command = [
            sys.executable, "-m", f"tests.foreign.{script}", "--folder", str(folder),
            "--connect", self.made.endpoint, "--rest-steps", str(REST_STEPS), *options,
        ]  # fmt: skip
        robot = Robot(command, self.made.folder / f"{name}.log", folder=folder)
        self.made.processes.append(robot.start())
        return robot

    def ask(self, topic: str, robot: str, robots: int, request: bytes = b"") -> list[bytes]:
        """Return what so many robots reply to an observer, when all of them do; `*` asks all."""
        session = open_session(NetworkSettings(connect=(self.made.endpoint,)))
        answers: list[bytes] = []

        def have_answered() -> bool:
            key = f"crcolony/1/colony/colony/{topic}/{robot}"
            replies = session.get(key, payload=request or None, timeout=5.0)
            answers[:] = [_signed(reply.ok) for reply in replies if reply.ok is not None]
            return len(answers) == robots

        try:
            wait_until(have_answered, f"{robots} robots reply about {topic}")
        finally:
            session.close()  # type: ignore[no-untyped-call]
        return answers

    def matings_of(self, robot: Robot) -> set[Encounter]:
        """Return the matings that are on a foreign robot's disk, as it runs."""
        return {encounter for encounter, _ in _foreign_sides(robot)}

    def forget_refusals(self) -> None:
        """Count from now on what our robots refuse."""
        self._refused_before = self._refused()

    def refused(self, times: int) -> bool:
        """Return whether our robots have refused so many envelopes, as their states say."""
        return self._refused() >= self._refused_before + times

    def observed(self, robot: bytes, ticks: int) -> bool:
        """Return whether a robot has had a body for so many ticks."""
        ticks_seen = {
            line.state.tick
            for line in self.view.all(StateReceived)
            if line.state.robot == robot and line.state.arena
        }
        return len(ticks_seen) > 1 and max(ticks_seen) - min(ticks_seen) >= ticks

    def _refused(self) -> int:
        states = self.view.update().states
        return sum(states[robot].refused for robot in self.made.ids)


def _signed(reply: zenoh.Sample) -> bytes:
    """Return what a robot replied, after its signature was verified."""
    telemetry = open_telemetry(reply.payload.to_bytes())
    assert telemetry.is_valid(purpose_of_robot("colony"))
    assert robot_id(telemetry.key).hex() == str(reply.key_expr).rpartition("/")[2]
    return telemetry.content


@contextlib.contextmanager
def foreign_colony(folder: Path, slots: int) -> Iterator[ForeignColony]:
    """Run an arena and two of our robots inside the context; they have bodies, and see each other."""
    with colony(folder) as made:
        made.arena(slots, "--hz", "20")
        view = made.observer()
        for _ in range(2):
            made.robot()
        wait_until(lambda: view.are_connected(made.ids), "our robots have bodies and are peers")
        yield ForeignColony(made, view)


def key_between(one: bytes, other: bytes) -> SigningKey:
    """Return a key whose robot proposes to one of two robots, and is proposed to by the other."""
    low, high = sorted((one, other))
    while True:
        key = SigningKey(secrets.token_bytes(32))
        if low < id_of(bytes(key.verify_key)) < high:
            return key


def read_ledger(ours: Sequence[Path], foreign: Sequence[Robot]) -> Ledger:
    """Return all matings, after checking that each has both sides, with what was sent, and that none is open."""
    ledger: Ledger = {}
    for path in ours:
        stored = read_stored_robot(path)
        for record, decision in stored.matings:
            assert record.state in ("mated", "aborted"), f"it is open: {record}"
            assert (record.state == "mated") == (decision is not None)
            if decision is not None:
                side = Side(record.state, record.own, record.partner, decision.conceived)
                _add(ledger, record.encounter, stored.robot, side)
    for robot in foreign:
        for encounter, side in _foreign_sides(robot):
            assert side.state == "mated", f"it is open: {encounter}"
            _add(ledger, encounter, robot.id, side)
    for encounter, sides in ledger.items():
        assert set(sides) == {encounter.initiator, encounter.responder}, "a mating has one side"
        one, other = sides[encounter.initiator], sides[encounter.responder]
        assert (one.own, other.own) == (other.partner, one.partner), "what arrived was not sent"
    return ledger


def open_encounters(robot: Robot) -> set[Encounter]:
    """Return what a foreign robot has open on its disk."""
    with _records(robot) as records:
        return {Encounter(*record.encounter) for record in records.open()}


def _add(ledger: Ledger, encounter: Encounter, robot: bytes, side: Side) -> None:
    sides = ledger.setdefault(encounter, {})
    assert robot not in sides, "an encounter is decided twice"
    sides[robot] = side


def _foreign_sides(robot: Robot) -> list[tuple[Encounter, Side]]:
    with _records(robot) as records:
        found = [*records.matings(), *records.open()]
    return [
        (
            Encounter(*record.encounter),
            Side(
                record.state.lower(),
                Offer(record.agent, record.genes),
                Offer(record.partner_agent, record.partner_genes),
                bool(record.conceived),
            ),
        )
        for record in found
        if record.state in ("MATED", "DECIDED")
    ]


@contextlib.contextmanager
def _records(robot: Robot) -> Iterator[Records]:
    records = Records(robot.folder / "foreign.sqlite")
    try:
        yield records
    finally:
        records.close()
