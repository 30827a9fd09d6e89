"""A connection to one Aseba node: the handshake, the upload of the program that stops its wheels, and its readings.

All methods raise DeviceLostError when the connection is gone, or when the node is not ours any more.
"""

import secrets
import time
from collections import deque
from dataclasses import dataclass

import numpy as np

from crcolony_bridge.aseba.ir_words import NO_WORD, find_word_port
from crcolony_bridge.aseba.line import AsebaLine
from crcolony_bridge.aseba.models import MODELS, AsebaModel, find_model
from crcolony_bridge.aseba.program import (
    Chunk,
    ProgramPlan,
    ProgramVariables,
    WordPort,
    dead_man_program,
    plan_chunks,
)
from crcolony_bridge.aseba.protocol import (
    FIRST_SYSTEM_TYPE,
    AsebaError,
    AsebaMessage,
    AsebaType,
    NodeDescription,
    parse_description,
    request,
)
from crcolony_bridge.aseba.senses import Senses, Words
from crcolony_bridge.aseba.ticks import TickClock
from crcolony_bridge.errors import DeviceError, DeviceLostError
from crcolony_bridge.link import Link

_TRIES, _REPLY_TIMEOUT_S = 3, 0.5
_OTHER_NODES_S = 0.1
"""How long other nodes on the same line are waited for."""
_CALIBRATION_TIMEOUT_S = 3.0
_MAX_NODES = 64
_MAX_RECEIVED = 32
"""Words by infrared that wait for the next reading."""
_ENDING: dict[int, str] = {
    AsebaType.DISCONNECTED: "it has left",
    AsebaType.DESCRIPTION: "it has been switched on again",
    AsebaType.EXECUTION_STATE: "another controller has reset or stopped its program",
    AsebaType.ACCESS_OUT_OF_BOUNDS: "its program has failed",
    AsebaType.DIVISION_BY_ZERO: "its program has failed",
    AsebaType.NODE_ERROR: "its program has failed",
}
"""Messages after which the program that we have uploaded does not run any more."""


@dataclass(frozen=True)
class NodeReading:
    """All variables that were emitted at once."""

    words: Words
    """Every variable of the node by its address; 0 where it was not emitted"""
    is_stopped: bool


class AsebaSession:
    """A node that runs our program. One thread reads; any may command."""

    def __init__(self, link: Link, address: str) -> None:
        self._line, self._address = AsebaLine(link, address), address
        self._chunks: tuple[Chunk, ...] = ()
        self._number = secrets.randbelow(0x7FFF) + 1
        self._is_running = False
        self._port: WordPort | None = None
        self._received: deque[int] = deque(maxlen=_MAX_RECEIVED)
        self.clock = TickClock()

    def start(self, uid: str, is_stopped: bool) -> None:
        """Find the node of this uid ("" for the only one), and have it run our program, with or without the latch.

        Raises DeviceError where a person has to do something.
        """
        try:
            self._line.discard_half_messages()
            self._node = self._find(uid)
            self.model, self.uid = self._identify(self._node)
            self._check_uid(uid)
            self.senses = Senses(self.model, self._node)
            self._upload(is_stopped)
            self._calibrate()
        except AsebaError as error:
            raise DeviceError(f"{self._address}: {error}") from None

    def read(self, timeout_s: float) -> NodeReading | None:
        """Wait for the newest reading for so long; None after a time-out."""
        newest: NodeReading | None = None
        end_s = time.monotonic() + timeout_s
        while True:
            left_s = end_s - time.monotonic()
            messages = self._line.receive(left_s if newest is None else 0.0)
            for message in messages:
                newest = self._take(message) or newest
            if newest is not None and not messages:
                self.clock.add(time.monotonic(), int(newest.words[self._own.ticks]) & 0xFFFF)
                return newest
            if left_s <= 0.0:
                return newest

    def command(
        self, speeds: tuple[float, float], lamp: tuple[float, float, float], ttl_s: float
    ) -> None:
        """Set the wheels' speeds (m/s) for so long, and the lamp (0 to 1)."""
        left, right = (round(speed * self.model.units_per_m_s) for speed in speeds)
        ticks = self.clock.count_of(ttl_s) if (left or right) else 0
        levels = (round(level * self.model.lamp.full) for level in lamp)
        self._set(self._own.counter, ticks, left, right, *levels)

    @property
    def has_words(self) -> bool:
        """Whether the infrared of this node carries words."""
        return self._port is not None

    def take_words(self) -> list[int]:
        """Return the words that were received by infrared since the last call."""
        taken = list(self._received)
        self._received.clear()
        return taken

    def send_word(self, word: int | None) -> None:
        """Let the infrared repeat a word from now on, or nothing."""
        if self._port is not None:
            self._set(self._port.sent, NO_WORD if word is None else word)

    def stop(self) -> None:
        """Latch the emergency stop in the robot, and set its motors to 0 whether its program runs or not."""
        self._set(self._own.stopped, 1, 0)
        self._stand_still()

    def clear(self) -> None:
        """Release the latch."""
        self._set(self._own.stopped, 0, 0, 0, 0)

    def close(self) -> None:
        """Close the connection."""
        self._line.close()

    # The handshake --------------------------------------------------------------------------------------------------

    def _find(self, uid: str) -> NodeDescription:
        number = uid.rpartition("-")[2]
        wanted = int(number) if number.isdigit() else None
        nodes: set[int] = set()
        for _ in range(_TRIES):
            self._line.send(request(AsebaType.LIST_NODES, 5))
            wait_s = _REPLY_TIMEOUT_S
            while wanted not in nodes and len(nodes) < _MAX_NODES:
                if not self._line.wait(lambda message: self._is_new(message, nodes), wait_s):
                    break
                wait_s = _OTHER_NODES_S
            if nodes:
                break
        if not nodes:
            raise DeviceError(
                f"{self._address}: no Aseba node answers; check that a robot is switched on there,"
                " and that its firmware speaks version 5 of the protocol"
            )
        if wanted in nodes:
            return self._describe(wanted)
        if len(nodes) > 1:
            found = ", ".join(str(node) for node in sorted(nodes))
            raise DeviceError(f"{self._address}: nodes {found} are there; give the uid of one")
        return self._describe(nodes.pop())

    def _is_new(self, message: AsebaMessage, nodes: set[int]) -> bool:
        known = len(nodes)
        if message.type == AsebaType.NODE_PRESENT:
            nodes.add(message.source)
        return len(nodes) > known

    def _describe(self, node: int) -> NodeDescription:
        for _ in range(_TRIES):
            parts: list[NodeDescription] = []

            def is_described(message: AsebaMessage, parts: list[NodeDescription] = parts) -> bool:
                if message.source != node:
                    return False
                if message.type == AsebaType.DESCRIPTION:
                    parts[:] = [parse_description(message)]
                elif parts:
                    parts[0].add(message)
                return bool(parts) and parts[0].is_complete

            self._line.send(request(AsebaType.GET_NODE_DESCRIPTION, node, 5))
            if self._line.wait(is_described, 2 * _REPLY_TIMEOUT_S):
                return parts[0]
        raise DeviceLostError(f"{self._address}: node {node} does not say what it is")

    def _identify(self, node: NodeDescription) -> tuple[AsebaModel, str]:
        model = find_model(node.name)
        if model is None:
            known = ", ".join(model.node_name for model in MODELS)
            raise AsebaError(f"a robot named {node.name} is not known; known are {known}")
        return model, f"{model.uid}-{node.node}"

    def _check_uid(self, uid: str) -> None:
        if uid and uid != self.uid:
            raise DeviceError(f"{self._address}: robot {self.uid} is there, not {uid}")

    def _upload(self, is_stopped: bool) -> None:
        """Have the program run, and give it our number: it holds that until somebody resets it."""
        node, model = self._node, self.model
        self._own = ProgramVariables(node.first_free_word)
        spans = [*self.senses.spans(), (self._own.session, ProgramVariables.WORDS)]
        self._chunks = plan_chunks(spans)
        self._words = np.zeros(node.variable_words, np.int16)
        self._port = find_word_port(model.ir_words, node)
        plan = ProgramPlan(
            model.tick_event,
            model.reading_event,
            model.motors,
            model.lamp.variables,
            model.lamp.native,
            self._chunks,
            self._port,
        )
        program = dead_man_program(node, plan, self._own)
        self._stand_still()
        self._line.send(request(AsebaType.SET_BYTECODE, node.node, 0, *program))
        self._line.send(request(AsebaType.RUN, node.node))
        end_s = time.monotonic() + _CALIBRATION_TIMEOUT_S
        while not self._is_running:
            # Set until it is kept: a program that only begins now clears it.
            self._set(self._own.session, self._number, 0, int(is_stopped), 0)
            self._line.wait(self._is_ours, 0.2)
            if time.monotonic() > end_s:
                raise DeviceLostError(f"{self._address}: {self.uid} does not run its program")

    def _is_ours(self, message: AsebaMessage) -> bool:
        self._is_running = self._gather(message) and self._holds_our_number()
        return self._is_running

    def _calibrate(self) -> None:
        end_s = time.monotonic() + _CALIBRATION_TIMEOUT_S
        while not self.clock.is_calibrated:
            self.read(_REPLY_TIMEOUT_S)
            if time.monotonic() > end_s:
                raise DeviceLostError(f"{self._address}: {self.uid} sends no readings")

    # Messages -------------------------------------------------------------------------------------------------------

    def _take(self, message: AsebaMessage) -> NodeReading | None:
        """Return the reading that this message completes; raises DeviceLostError if the node is not ours any more."""
        if message.source != self._node.node:
            return None
        if (reason := _ENDING.get(message.type)) is not None:
            raise DeviceLostError(f"{self._address}: {self.uid}: {reason}")
        if self._port is not None and message.type == len(self._chunks):
            self._received += message.words[:1]
        if not self._gather(message):
            return None
        if not self._holds_our_number():
            raise DeviceLostError(f"{self._address}: {self.uid} runs another program, or was reset")
        return NodeReading(self._words.copy(), bool(self._words[self._own.stopped]))

    def _gather(self, message: AsebaMessage) -> bool:
        """Keep what a message holds; return whether it is the last one of a reading."""
        if message.type >= FIRST_SYSTEM_TYPE or message.source != self._node.node:
            return False
        if message.type >= len(self._chunks):
            return False
        chunk, words = self._chunks[message.type], message.words
        if len(words) != chunk.words:
            if self._is_running:
                raise DeviceLostError(f"{self._address}: {self.uid} runs another program")
            return False  # of the program that ran before ours
        self._words[chunk.address : chunk.address + chunk.words] = words
        return message.type == len(self._chunks) - 1

    def _holds_our_number(self) -> bool:
        return int(self._words[self._own.session]) == self._number

    def _stand_still(self) -> None:
        for motor in self.model.motors:
            self._set(self._node.address(motor), 0)

    def _set(self, address: int, *words: int) -> None:
        self._line.send(request(AsebaType.SET_VARIABLES, self._node.node, address, *words))
