"""A beacon's message in words of 11 bits, for infrared that carries no more at once, as that of a Thymio II.

A word names its place in the message (3 bits) and has the byte there (8 bits): a hash of the robot's id, its token,
the token that it received, and a checksum of these, two bytes each. So a word that is lost or repeated does no harm.
There is no room for an id: it is found among the robots that are on the network, or there is no contact.
"""

import binascii
import hashlib
import itertools
import math
from collections.abc import Iterable, Iterator, Sequence

from crcolony.protocol.identity import RobotId
from crcolony_bridge.infrared.beacon import BeaconForm, BeaconMessage

WORD_BYTES = 2
"""A word as a driver sends and receives it, big-endian, the highest 5 bits zero."""
WORD_LIMIT = 1 << 11
PLACES = 8
WORD_S = 0.2
"""For so long a word is repeated: a Thymio emits it twice."""
_PART_BYTES = 2
_CHECKED_BYTES = PLACES - _PART_BYTES
"""All but the checksum"""
_TOKEN_LIFE_MESSAGES = 10
"""A contact takes two or three messages of each side."""
_ANSWER_MESSAGES = 1.25
"""Enough for the other side to receive all, and as long as a mating waits for its contact"""
_KEEP_MESSAGES = 3
"""A word that was received so long ago is forgotten."""
_MAX_VALUES = 3
"""Bytes that are kept for a place: of three neighbours, or of one whose message has changed."""
_LATE = 0.15
"""Of the time of a word: a control period that begins so much too early is in time."""


def hash_id(robot: RobotId) -> bytes:
    """Return what a message has in place of an id."""
    return hashlib.blake2b(robot, digest_size=_PART_BYTES).digest()


def encode_short(message: BeaconMessage) -> bytes:
    """Return the byte of every place."""
    data = hash_id(message.robot) + message.token + (message.heard or bytes(_PART_BYTES))
    return data + _checksum(data)


def word_at(place: int, byte: int) -> int:
    """Return the word with the byte of a place."""
    return place << 8 | byte


def _checksum(data: bytes) -> bytes:
    return binascii.crc_hqx(data, 0xFFFF).to_bytes(_PART_BYTES, "big")


class WordSender:
    """Chooses the word to send: all of a message in turn, and those first that have changed.

    A message that changes all the time is sent whole between two changes: otherwise nobody would ever have all of it.
    """

    def __init__(self, word_s: float) -> None:
        self._word_s = word_s
        self._until_s = -math.inf
        self._data = b""
        self._order: Sequence[int] = range(PLACES)
        self._sent = PLACES
        self._word = 0

    def word(self, now_s: float, data: bytes) -> int:
        """Return the word to send now; `data` is the message (PLACES,) to send from now on."""
        if now_s < self._until_s - _LATE * self._word_s:
            return self._word
        self._until_s = now_s + self._word_s
        if data != self._data and self._sent >= PLACES:
            before, self._data, self._sent = self._data, data, 0
            self._order = sorted(range(PLACES), key=lambda k: before[k : k + 1] == data[k : k + 1])
        place = self._order[self._sent % PLACES]
        self._sent += 1
        self._word = word_at(place, self._data[place])
        return self._word


class WordReceiver:
    """Puts words of neighbours together, several at a time, in bounded memory.

    Nothing says whose a word is. What fits together by its checksum is a message; by chance 1 in 65,536 does.
    """

    def __init__(self, keep_s: float) -> None:
        self._keep_s = keep_s
        self._values: tuple[dict[int, float], ...] = tuple({} for _ in range(PLACES))
        """For every place the last bytes, each with the time when it was received last, the newest at the end"""

    def add(self, now_s: float, word: int) -> Iterator[tuple[bytes, float]]:
        """Add a word; yield the messages that are complete with it, without checksum, and how new each is.

        Of two messages of one robot some words are the same; the newer one has the greater sum of times.
        """
        place, byte = word >> 8, word & 0xFF
        if not 0 <= place < PLACES:
            return
        values = self._values[place]
        values.pop(byte, None)
        values[byte] = now_s
        if len(values) > _MAX_VALUES:
            del values[next(iter(values))]
        choices = [self._fresh(now_s, k) if k != place else [byte] for k in range(PLACES)]
        sums = {bytes(check) for check in itertools.product(*choices[_CHECKED_BYTES:])}
        for chosen in itertools.product(*choices[:_CHECKED_BYTES]):
            if sums and _checksum(data := bytes(chosen)) in sums:
                yield data, sum(map(self._received_s, range(PLACES), data + _checksum(data)))

    def _received_s(self, place: int, byte: int) -> float:
        return self._values[place][byte]

    def _fresh(self, now_s: float, place: int) -> list[int]:
        values = self._values[place]
        return [byte for byte, last_s in values.items() if now_s - last_s <= self._keep_s]


class ShortEncoding:
    """See `BeaconEncoding`; `robot` is the one whose beacon it is."""

    def __init__(self, robot: RobotId, word_s: float = WORD_S) -> None:
        self._robot = robot
        message_s = PLACES * word_s
        self.form = BeaconForm(
            _PART_BYTES,
            _TOKEN_LIFE_MESSAGES * message_s,
            has_envelopes=False,
            answer_s=_ANSWER_MESSAGES * message_s,
        )
        self._sender = WordSender(word_s)
        self._receiver = WordReceiver(_KEEP_MESSAGES * message_s)

    def encode(self, now_s: float, message: BeaconMessage) -> bytes:
        """See `BeaconEncoding`."""
        return self._sender.word(now_s, encode_short(message)).to_bytes(WORD_BYTES, "big")

    def decode(
        self, now_s: float, received: Iterable[bytes], online: Iterable[RobotId]
    ) -> list[BeaconMessage]:
        """See `BeaconEncoding`; there is no message of a robot that is not online, or not known from another."""
        newest: dict[bytes, tuple[float, bytes]] = {}  # by the hash of its robot
        for word in received:
            if len(word) == WORD_BYTES:
                for data, newness in self._receiver.add(now_s, int.from_bytes(word, "big")):
                    sender, found = data[:_PART_BYTES], (newness, data)
                    newest[sender] = max(newest.get(sender, found), found)
        messages = (self._resolve(data, online) for _, data in newest.values())
        return [message for message in messages if message is not None]

    def _resolve(self, data: bytes, online: Iterable[RobotId]) -> BeaconMessage | None:
        """Return the message of the only robot whose hash it has: our own beacon comes back from walls, too."""
        hashed, token, heard = (data[k : k + _PART_BYTES] for k in range(0, len(data), _PART_BYTES))
        robots = [robot for robot in {self._robot, *online} if hash_id(robot) == hashed]
        if len(robots) != 1 or robots[0] == self._robot:
            return None
        return BeaconMessage(robots[0], token, heard if any(heard) else b"")
