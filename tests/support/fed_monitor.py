"""A `ColonyMonitor` that tests feed with samples of one colony and one arena."""

from collections.abc import Sequence

import msgspec

from crcolony.protocol.codec import Message, encode
from crcolony.protocol.identity import RobotId, seeded
from crcolony.protocol.key_expressions import ArenaKeys, ColonyKeys
from crcolony.protocol.telemetry_messages import (
    EventMessage,
    Fault,
    HistoryReply,
    HistoryRequest,
    RobotMetadata,
    RobotState,
    decode_history_request,
)
from crcolony.telemetry.colony_monitor import ColonyMonitor
from crcolony.telemetry.samples import RawSample, SampleKind, parse_sample
from crcolony.telemetry.status_changes import EventReceived, StatusChange
from tests.vectors.make import TELEMETRY

KEYS = [seeded("test", 1, number) for number in range(100)]
IDS = [key.id for key in KEYS]
ME, PEER = IDS[:2]
COLONY, ARENA = ColonyKeys("blue"), ArenaKeys("lab")
T = 1_000.0
"""Unix seconds."""
A_STATE, A_SCENE = TELEMETRY["state"], TELEMETRY["scene"]


def message(seq: int, incarnation: int = 3, robot: RobotId = ME) -> EventMessage:
    return EventMessage(robot, incarnation, seq, 7, Fault(seq, "x"))


def state(seq: int = 0, incarnation: int = 3, robot: RobotId = ME) -> RobotState:
    assert isinstance(A_STATE, RobotState)
    return msgspec.structs.replace(A_STATE, robot=robot, incarnation=incarnation, seq=seq)


def numbers(changes: Sequence[StatusChange]) -> list[int]:
    """Return the sequence numbers of the events among changes."""
    return [change.message.seq for change in changes if isinstance(change, EventReceived)]


class FedMonitor(ColonyMonitor):
    """Every method is one sample that arrives at `now_s`."""

    now_s = T

    def handle(
        self, kind: SampleKind, key: str, message: Message | bytes = b""
    ) -> list[StatusChange]:
        payload = message if isinstance(message, bytes) else encode(message)
        raw = RawSample(kind, key, payload, int(1000.0 * self.now_s))
        return self.handle_sample(parse_sample(raw))

    def online(
        self, incarnation: int = 3, robot: RobotId = ME, session: str = "a"
    ) -> list[StatusChange]:
        return self.handle("online", COLONY.alive(robot, incarnation, session))

    def offline(
        self, incarnation: int = 3, robot: RobotId = ME, session: str = "a"
    ) -> list[StatusChange]:
        return self.handle("offline", COLONY.alive(robot, incarnation, session))

    def state(self, state: RobotState) -> list[StatusChange]:
        return self.handle("state", COLONY.state(state.robot), state)

    def events(self, *messages: EventMessage) -> list[int]:
        """Return the sequence numbers of those that are new."""
        changes = [c for m in messages for c in self.handle("event", COLONY.event(m.robot), m)]
        return numbers(changes)

    def metadata(self, metadata: RobotMetadata) -> list[StatusChange]:
        return self.handle("metadata", COLONY.metadata(metadata.robot), metadata)

    def history(
        self, oldest: int, messages: Sequence[EventMessage], robot: RobotId = ME
    ) -> list[int]:
        """Return the sequence numbers of those that are new."""
        reply = HistoryReply(3, oldest, [encode(message) for message in messages])
        return numbers(self.handle("history", COLONY.history(robot), reply))

    def online_with_metadata(self, incarnation: int = 3) -> None:
        """The robot comes online, and replies to the request for its metadata."""
        self.online(incarnation)
        self.due_requests(self.now_s)
        self.metadata(RobotMetadata(ME, incarnation, "{}", [], ""))

    def requests(self, unix_s: float = T) -> list[tuple[str, HistoryRequest | None]]:
        """Return the keys and payloads of the requests that are due."""
        return [
            (request.key, decode_history_request(request.payload) if request.payload else None)
            for request in self.due_requests(unix_s)
        ]

    def missing(self) -> int:
        sequence = self.robots[ME].sequence
        assert sequence is not None
        return sequence.missing
