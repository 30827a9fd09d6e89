"""Aseba nodes without a simulator: what they say of themselves, a small virtual machine, and a line that answers."""

import struct
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from crcolony_bridge.aseba.protocol import (
    PROTOCOL_VERSION,
    AsebaMessage,
    AsebaReader,
    AsebaType,
    NodeDescription,
    encode_message,
    parse_description,
)
from crcolony_bridge.errors import DeviceLostError

E_PUCK_VARIABLES = {
    "id": 1,
    "source": 1,
    "args": 32,
    "speed.left": 1,
    "speed.right": 1,
    "color.red": 1,
    "color.green": 1,
    "color.blue": 1,
    "prox": 8,
    "cam.red": 60,
    "cam.green": 60,
    "cam.blue": 60,
    "energy": 1,
}
THYMIO_VARIABLES = {
    "_id": 1,
    "event.source": 1,
    "event.args": 32,
    "prox.horizontal": 7,
    "motor.left.target": 1,
    "motor.right.target": 1,
    "motor.left.speed": 1,
    "motor.right.speed": 1,
}


def _text(text: str) -> bytes:
    data = text.encode()
    return bytes([len(data)]) + data


@dataclass(frozen=True)
class Node:
    """What a node is."""

    name: str
    variables: dict[str, int]
    events: Sequence[str]
    natives: Sequence[str] = ()
    number: int = 1
    version: int = PROTOCOL_VERSION
    bytecode_words: int = 1024
    free_words: int = 256

    @property
    def messages(self) -> list[AsebaMessage]:
        """What it answers when it is asked."""
        words = sum(self.variables.values()) + self.free_words
        counts = (len(self.variables), len(self.events), len(self.natives))
        head = struct.pack("<7H", self.version, self.bytecode_words, 32, words, *counts)
        return [
            self._message(AsebaType.DESCRIPTION, _text(self.name) + head),
            *(
                self._message(AsebaType.NAMED_VARIABLE, struct.pack("<H", size) + _text(name))
                for name, size in self.variables.items()
            ),
            *(
                self._message(AsebaType.LOCAL_EVENT, _text(name) + _text("it happens"))
                for name in self.events
            ),
            *(
                self._message(AsebaType.NATIVE_FUNCTION, _text(name) + _text("it does"))
                for name in self.natives
            ),
        ]

    @property
    def described(self) -> NodeDescription:
        """The description that these messages make."""
        first, *others = self.messages
        description = parse_description(first)
        for message in others:
            description.add(message)
        return description

    def _message(self, type_: AsebaType, payload: bytes) -> AsebaMessage:
        return AsebaMessage(type_, payload, self.number)


E_PUCK_NODE = Node("e-puck0", E_PUCK_VARIABLES, ("ir_sensors", "camera"))
THYMIO_NODE = Node("thymio-II", THYMIO_VARIABLES, ("prox", "motor"), ("leds.circle", "leds.top"))


class SmallVm:
    """Runs Aseba's bytecode, as far as our programs use it."""

    def __init__(self, program: Sequence[int], variables: int) -> None:
        self._program = program
        self.variables = [0] * variables
        self.called: list[tuple[int, list[int]]] = []
        """Native functions that were called, and the stack then"""

    def run(self, event: int) -> list[tuple[int, list[int]]]:
        """Run the handler of an event; return the events that it emits and their words."""
        table = self._program[: self._program[0]]
        handlers = dict(zip(table[1::2], table[2::2], strict=True))
        emitted: list[tuple[int, list[int]]] = []
        at, stack = handlers[event], list[int]()
        while (word := self._program[at]) != 0:
            at += self._step(word, self._program[at + 1 : at + 3], stack, emitted)
        return emitted

    def _step(
        self,
        word: int,
        behind: Sequence[int],
        stack: list[int],
        emitted: list[tuple[int, list[int]]],
    ) -> int:
        """Do one instruction; return how far the next one is."""
        operand = word & 0x0FFF
        match word >> 12:
            case 0x1:
                stack.append(_signed(operand, 12))
            case 0x2:
                stack.append(_signed(behind[0], 16))
                return 2
            case 0x3:
                stack.append(self.variables[operand])
            case 0x4:
                self.variables[operand] = stack.pop()
            case 0x8:
                right, left = stack.pop(), stack.pop()
                stack.append(_signed({2: left + right, 3: left - right}[operand], 16))
            case 0x9:
                return _signed(operand, 12)
            case 0xA:
                right, left = stack.pop(), stack.pop()
                is_met = {0xB: left != right, 0xC: left > right}[operand]
                return 2 if is_met else _signed(behind[0], 16)
            case 0xB:
                start, length = behind
                emitted.append((operand, self.variables[start : start + length]))
                return 3
            case 0xC:
                self.called.append((operand, stack[:]))
                stack.clear()
            case other:
                raise AssertionError(f"instruction {other:x}")
        return 1


def _signed(value: int, bits: int) -> int:
    value &= (1 << bits) - 1
    return value - (1 << bits) if value >> (bits - 1) else value


@dataclass
class Line:
    """A link to nodes that say what they are, and run nothing."""

    nodes: Iterable[Node]
    half: bytes = b""
    """The rest of a message that has begun before"""
    _reader: AsebaReader = field(default_factory=AsebaReader)
    _answers: deque[AsebaMessage] = field(default_factory=deque)

    def read(self, timeout_s: float) -> bytes:
        """Return an answer; there is nothing to wait for."""
        if self.half:
            half, self.half = self.half, b""
            return half
        return encode_message(self._answers.popleft()) if self._answers else b""

    def write(self, data: bytes) -> None:
        """Answer."""
        for message in self._reader.feed(data):
            for node in self.nodes:
                if message.type == AsebaType.LIST_NODES:
                    version = struct.pack("<H", node.version)
                    self._answers.append(AsebaMessage(AsebaType.NODE_PRESENT, version, node.number))
                is_asked = message.words[:1] == (node.number,)
                if message.type == AsebaType.GET_NODE_DESCRIPTION and is_asked:
                    self._answers += node.messages

    def close(self) -> None:
        """Nothing has to be closed."""


@dataclass
class Noise:
    """A link on which these bytes arrive after a pause, whatever is asked, and that is gone then."""

    pieces: list[bytes]

    def __post_init__(self) -> None:
        self.pieces = [b"", *self.pieces]

    def read(self, timeout_s: float) -> bytes:
        """Return the next piece."""
        if not self.pieces:
            raise DeviceLostError("the noise is over")
        return self.pieces.pop(0)

    def write(self, data: bytes) -> None:
        """Nobody listens."""

    def close(self) -> None:
        """Nothing has to be closed."""
