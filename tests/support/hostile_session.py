"""What a hostile peer knows of a colony, and how it sends raw bytes to it."""

import random
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import zenoh
from zenoh.handlers import Callback

from crcolony.config import Config
from crcolony.protocol.body_messages import Observation, decode_observation
from crcolony.protocol.codec import WireError
from crcolony.protocol.envelope import has_valid_signature, open_envelope
from crcolony.protocol.identity import Identity, robot_id
from crcolony.protocol.key_expressions import ArenaKeys, ColonyKeys
from crcolony.protocol.link_keys import CODE_BYTES
from crcolony.protocol.mating_messages import Encounter, MatingMessage, Propose
from crcolony.robot.genes import agent_schema
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import open_session
from tests.support.lawless_session import open_lawless_session

COLONY, ARENA = "colony", "arena"
SCHEMA = agent_schema(Config().learning, Config().heredity)
DIGEST = bytes.fromhex(SCHEMA.digest)


@dataclass(frozen=True)
class Insider:
    """A robot of a deployment that has turned hostile."""

    identity: Identity
    credentials: Path
    """The robot's own; it obeys no access control itself"""
    spying: Path
    """Credentials of a router, with which it hears everything: more than it could"""


class Hostile:
    """What an attacker knows, and how it reaches a colony."""

    def __init__(
        self, endpoint: str, robots: list[bytes], seed: int, insider: Insider | None = None
    ) -> None:
        self.endpoint, self.robots = endpoint, robots
        self.chance = random.Random(seed)
        self.me = Identity(self.chance.randbytes(32)) if insider is None else insider.identity
        self.recorded: deque[tuple[bytes, bytes, MatingMessage]] = deque(maxlen=2_000)
        """Receiver, envelope and message of what honest robots sent"""
        self.keys: dict[bytes, bytes] = {}
        """Public keys of honest robots"""
        self.nonces: dict[bytes, int] = {}
        """Of the last contact of every robot"""
        self.observations: dict[bytes, Observation] = {}
        self.colony, self.arena = ColonyKeys(COLONY), ArenaKeys(ARENA)
        self._publishers: dict[str, zenoh.Publisher] = {}
        if insider is None:
            self.session = self._listening = open_session(NetworkSettings(connect=(endpoint,)))
        else:
            self.session = open_lawless_session(endpoint, insider.credentials)
            network = NetworkSettings(connect=(endpoint,), credentials=insider.spying)
            self._listening = open_session(network)
        self._subscribers = [
            self._listening.declare_subscriber(key, Callback(handler(robot), indirect=False))
            for robot in robots
            for key, handler in (
                (self.colony.inbox(robot), self._record_envelope),
                (self.arena.observation(robot), self._record_observation),
            )
        ]

    def _record_envelope(self, receiver: bytes) -> Callable[[zenoh.Sample], None]:
        def handle_sample(sample: zenoh.Sample) -> None:
            data = sample.payload.to_bytes()
            try:
                envelope, message = open_envelope(data)
            except WireError:
                return
            sender = robot_id(envelope.key)
            # One that listens in another session than it attacks in hears itself, too.
            if sender in self.robots and has_valid_signature(envelope, COLONY):
                self.keys[sender] = envelope.key
                self.recorded.append((receiver, data, message))

        return handle_sample

    def _record_observation(self, robot: bytes) -> Callable[[zenoh.Sample], None]:
        def handle_sample(sample: zenoh.Sample) -> None:
            try:
                self.observations[robot] = seen = decode_observation(
                    sample.payload.to_bytes()[:-CODE_BYTES]
                )
            except WireError:
                return
            if seen.contact is not None:
                self.nonces[robot] = seen.contact.nonce

        return handle_sample

    @property
    def is_ready(self) -> bool:
        """Whether it has recorded enough of every robot."""
        return len(self.keys) == len(self.nonces) == len(self.robots) and len(self.recorded) > 20

    def put(self, key: str, data: bytes) -> None:
        """Publish to others than itself."""
        if key not in self._publishers:
            self._publishers[key] = self.session.declare_publisher(
                key, allowed_destination=zenoh.Locality.REMOTE
            )
        self._publishers[key].put(data)

    def post(self, envelope: bytes, to: bytes | None = None) -> None:
        """Send an envelope to a robot, or to any."""
        self.put(self.colony.inbox(to or self.victim()), envelope)

    def query(self, key: str, request: bytes) -> None:
        """Send a query, and ignore the replies."""
        self.session.get(key, lambda _: None, payload=request, timeout=0.5)

    def victim(self) -> bytes:
        """Return any honest robot."""
        return self.chance.choice(self.robots)

    def peer_of(self, robot: bytes) -> bytes:
        """Return another honest robot."""
        return self.chance.choice([other for other in self.robots if other != robot])

    def envelope(self) -> tuple[bytes, bytes, MatingMessage]:
        """Return any recorded envelope, with its receiver and its message."""
        return self.chance.choice(tuple(self.recorded))

    def genes(self) -> np.ndarray:
        """Return genes that fit the schema."""
        return SCHEMA.random(np.random.default_rng(self.chance.getrandbits(32)))

    def proposal(self, by: bytes, to: bytes, genes: bytes) -> Propose:
        """Return a proposal with the nonce of the receiver's last contact."""
        encounter = Encounter(by, to, int(time.time()), self.chance.randrange(1, 2**20))
        return Propose(encounter, self.nonces[to], DIGEST, "hostile/1", genes)
