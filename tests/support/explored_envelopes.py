"""The envelopes that were ever sent in an exploration, genuine and forged; a set of them is the bits of an integer."""

from collections.abc import Iterable

from crcolony.protocol.envelope import sign_message
from crcolony.protocol.mating_messages import (
    BY_INITIATOR,
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
from tests.support.explored_robot import COLONY, KEYS, SCHEMA, SentEnvelope, forge


class ExploredEnvelopes:
    """All envelopes that were ever sent, each once."""

    def __init__(self) -> None:
        self._envelopes: list[SentEnvelope] = []
        self._numbers: dict[bytes, int] = {}
        self._bits: dict[MatingMessage, int] = {}
        self.to = [0] * len(KEYS)
        """Of every robot, a bit for every envelope to it"""

    def __getitem__(self, number: int) -> SentEnvelope:
        return self._envelopes[number]

    def with_data(self, data: bytes) -> SentEnvelope | None:
        """Return the envelope with these bytes, None if none was sent."""
        number = self._numbers.get(data)
        return None if number is None else self._envelopes[number]

    def send(self, message: MatingMessage, robot: int) -> int:
        """Sign a message as a robot and send it; return its bit."""
        if message not in self._bits:
            data = sign_message(message, COLONY, KEYS[robot])
            self._bits[message] = self._add(message, data, has_valid_signature=True)
        return self._bits[message]

    def send_forged(self, pairs: Iterable[tuple[int, int]]) -> int:
        """Send what an attacker can who knows everything but the secret keys, and envelopes of another colony."""
        sent, genes = 0, b"forged!!"
        for one, other in dict.fromkeys(pairs):
            for a, b in ((one, other), (other, one)):
                e = Encounter(KEYS[a].id, KEYS[b].id, 1, 1)
                propose = Propose(e, 1, SCHEMA, "forged", genes)
                accept = Accept(e, 1, SCHEMA, "forged", genes)
                for message in (propose, accept, Refuse(e, "busy"), Commit(e), Abort(e), Done(e)):
                    owner = KEYS[a if isinstance(message, BY_INITIATOR) else b]
                    sent |= self._add(message, forge(message, owner), has_valid_signature=False)
                stolen = sign_message(propose, "another", KEYS[a])
                sent |= self._add(propose, stolen, has_valid_signature=False)
        return sent

    def _add(self, message: MatingMessage, data: bytes, has_valid_signature: bool) -> int:
        to = [key.id for key in KEYS].index(receiver_of(message))
        bit = 1 << len(self._envelopes)
        self._numbers[data] = len(self._envelopes)
        self._envelopes.append(SentEnvelope(to, data, message, has_valid_signature))
        self.to[to] |= bit
        return bit


def bits(mask: int) -> Iterable[int]:
    """Return the numbers of the bits that are set, in ascending order."""
    while mask:
        lowest = mask & -mask
        yield lowest.bit_length() - 1
        mask ^= lowest
