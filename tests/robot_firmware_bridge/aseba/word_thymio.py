"""A Thymio II whose infrared carries words, by its description and a small virtual machine that runs our bytecode.

It is ours: no simulator of others that runs here has working infrared. It does what the sources of the real firmware
do with `prox.comm`: while that is enabled and the word is not negative, the word is emitted ten times a second.
"""

import struct
import time
from collections import deque
from dataclasses import replace

from crcolony_bridge.aseba.models import THYMIO
from crcolony_bridge.aseba.protocol import (
    EVENT_INIT,
    AsebaMessage,
    AsebaReader,
    AsebaType,
    encode_message,
)

from tests.robot_firmware_bridge.aseba.nodes import THYMIO_NODE, Node, SmallVm

assert THYMIO.ir_words is not None
WORDS = THYMIO.ir_words
WITHOUT_EFFECT = replace(
    THYMIO_NODE,
    variables={**THYMIO_NODE.variables, WORDS.received: 1, WORDS.sent: 1},
    events=(*THYMIO_NODE.events, WORDS.event),
    natives=(*THYMIO_NODE.natives, WORDS.enable),
)
"""As simulators describe themselves"""
WORD_THYMIO = replace(WITHOUT_EFFECT, variables={**WITHOUT_EFFECT.variables, WORDS.known_by: 7})
"""As real ones do"""
_TICK_S, _TICKS_A_READING = 0.02, 5


class WordThymio:
    """A link to a robot that runs whatever program is uploaded; `others` are those that it faces."""

    def __init__(self, node: Node = WORD_THYMIO) -> None:
        self.node, self.others = node, list[WordThymio]()
        self._described = node.described
        self._vm: SmallVm | None = None
        self._program: tuple[int, ...] = ()
        self._reader = AsebaReader()
        self._answers: deque[AsebaMessage] = deque()
        self._ticked_s, self._ticks = time.monotonic(), 0

    def variable(self, name: str) -> int:
        """Return the value of a variable."""
        assert self._vm is not None
        return self._vm.variables[self._described.address(name)]

    def read(self, timeout_s: float) -> bytes:
        """Let time pass until there is an answer, or for so long."""
        end_s = time.monotonic() + timeout_s
        while not self._answers and time.monotonic() < end_s:
            if self._vm is not None and time.monotonic() - self._ticked_s >= _TICK_S:
                self._tick()
            time.sleep(0.002)
        return encode_message(self._answers.popleft()) if self._answers else b""

    def write(self, data: bytes) -> None:
        """Answer, or do what is asked."""
        for message in self._reader.feed(data):
            words = [word & 0xFFFF for word in message.words]
            if message.type == AsebaType.LIST_NODES:
                version = struct.pack("<H", self.node.version)
                self._answers.append(
                    AsebaMessage(AsebaType.NODE_PRESENT, version, self.node.number)
                )
            elif message.type == AsebaType.GET_NODE_DESCRIPTION:
                self._answers += self.node.messages
            elif message.type == AsebaType.SET_BYTECODE:
                self._program = tuple(words[2:])
            elif message.type == AsebaType.RUN:
                self._vm = SmallVm(self._program, self._described.variable_words)
                self._run(EVENT_INIT)
            elif message.type == AsebaType.SET_VARIABLES and self._vm is not None:
                values = message.words[2:]
                self._vm.variables[words[1] : words[1] + len(values)] = values

    def close(self) -> None:
        """Nothing has to be closed."""

    def hear(self, word: int) -> None:
        """Receive a word by infrared."""
        if self._vm is not None and self._is_enabled():
            self._vm.variables[self._described.address(WORDS.received)] = word
            self._run(self._described.event(WORDS.event))

    def _tick(self) -> None:
        self._ticked_s = time.monotonic()
        self._ticks += 1
        self._run(self._described.event(THYMIO.tick_event))
        if self._ticks % _TICKS_A_READING == 0:
            self._run(self._described.event(THYMIO.reading_event))
            if self._is_enabled() and self.variable(WORDS.sent) >= 0:
                for other in self.others:
                    other.hear(self.variable(WORDS.sent))

    def _is_enabled(self) -> bool:
        """Return whether the native function was called with the address of a variable that is not 0."""
        assert self._vm is not None
        if WORDS.enable not in self.node.natives:
            return False
        enable = self.node.natives.index(WORDS.enable)
        return any(
            native == enable and self._vm.variables[stack[-1]] != 0
            for native, stack in self._vm.called
        )

    def _run(self, event: int) -> None:
        assert self._vm is not None
        for type_, words in self._vm.run(event):
            payload = struct.pack(f"<{len(words)}h", *words)
            self._answers.append(AsebaMessage(type_, payload, self.node.number))
