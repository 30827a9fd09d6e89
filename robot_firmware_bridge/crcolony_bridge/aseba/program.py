"""The program that is uploaded to an Aseba robot before its first motor command: the dead-man switch, and readings.

At every tick (a local event of the robot) a counter goes down, and at 0 the motors stand still. The host sets the
counter with every command, so that wheels stop whatever becomes of the host. Speeds and lamp go through variables of
the program too: one message sets them and the counter at once, and a speed that anybody else sets is overwritten at
the next tick. At its reading event the program emits what the robot measures, and every word that the robot receives
by infrared at once.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from crcolony_bridge.aseba.protocol import (
    EVENT_INIT,
    MAX_EVENT_WORDS,
    AsebaError,
    NodeDescription,
)

_STOP, _IMMEDIATE, _LARGE, _LOAD, _STORE = 0x0000, 0x1000, 0x2000, 0x3000, 0x4000
_BINARY, _JUMP, _BRANCH, _EMIT, _CALL = 0x8000, 0x9000, 0xA000, 0xB000, 0xC000
_ADD, _SUBTRACT, _NOT_EQUAL, _BIGGER = 0x2, 0x3, 0xB, 0xC
_ADDRESSES = 0x1000
"""An instruction has 12 bits for an address."""
_GAP_WORDS = 16
"""Words that nobody needs are emitted too, where a message more would cost about as much."""


@dataclass(frozen=True)
class ProgramVariables:
    """Addresses of the program's own variables, one word each, in the order of the properties."""

    session: int
    """A number of the host's that a reset clears: by it the host knows that the program is still its own"""

    WORDS = 10

    @property
    def ticks(self) -> int:
        """Ticks since the start; it wraps."""
        return self.session + 1

    @property
    def stopped(self) -> int:
        """Not 0 while the emergency stop is latched."""
        return self.session + 2

    @property
    def counter(self) -> int:
        """Ticks for which the wheels still turn; behind it the speeds and the lamp."""
        return self.session + 3

    @property
    def speeds(self) -> tuple[int, int]:
        """Speeds of the left and the right wheel."""
        return self.session + 4, self.session + 5

    @property
    def lamp(self) -> tuple[int, int, int]:
        """Red, green and blue."""
        return self.session + 6, self.session + 7, self.session + 8

    @property
    def one(self) -> int:
        """A variable that is 1 from the start on: native functions take addresses, not numbers."""
        return self.session + 9


@dataclass(frozen=True)
class Chunk:
    """Variables that are emitted together; the event's number is the chunk's place among the others."""

    address: int
    words: int


@dataclass(frozen=True)
class WordPort:
    """Infrared that carries words; the event that emits one has the number behind those of the chunks."""

    sent: int
    """The address of the word that the robot repeats"""
    received: int
    """The address of the word that it has received"""
    event: str
    enable: str
    """The native function that switches it on"""


@dataclass(frozen=True)
class ProgramPlan:
    """What the program has to know of a robot."""

    tick_event: str
    reading_event: str
    motors: tuple[str, str]
    lamp: tuple[str, ...]
    """Three variables, or none"""
    lamp_native: str
    """Or the native function that takes the addresses of red, green and blue"""
    chunks: tuple[Chunk, ...]
    words: WordPort | None = None


def plan_chunks(spans: Iterable[tuple[int, int]]) -> tuple[Chunk, ...]:
    """Return few messages that hold all of these variables, each an address and a size."""
    chunks: list[Chunk] = []
    for address, words in sorted(spans):
        end = address + words
        if chunks and address - (chunks[-1].address + chunks[-1].words) <= _GAP_WORDS:
            start = chunks[-1].address
            joined = max(end, start + chunks[-1].words) - start
            if joined <= MAX_EVENT_WORDS:
                chunks[-1] = Chunk(start, joined)
                continue
        chunks.append(Chunk(address, words))
    return tuple(chunks)


def dead_man_program(
    node: NodeDescription, plan: ProgramPlan, own: ProgramVariables
) -> tuple[int, ...]:
    """Return the program's words; raises AsebaError if the robot has no such variable or event, or no room."""
    motors = [node.address(name) for name in plan.motors]
    stand_still = [word for motor in motors for word in _assign(motor, 0)]
    own_words = range(own.session, own.session + ProgramVariables.WORDS)
    initialise = [*(word for address in own_words for word in _assign(address, 0)), *stand_still]
    handlers = {EVENT_INIT: initialise}
    if plan.words is not None:
        initialise += _enable_words(node, plan.words, own)
        heard = [_EMIT | len(plan.chunks), plan.words.received, 1]
        handlers[node.event(plan.words.event)] = heard
    run = [
        *(_LOAD | own.counter, _IMMEDIATE | 1, _BINARY | _SUBTRACT, _STORE | own.counter),
        *(word for pair in zip(own.speeds, motors, strict=True) for word in _copy(*pair)),
    ]
    tick = [
        *(_LOAD | own.ticks, _IMMEDIATE | 1, _BINARY | _ADD, _STORE | own.ticks),
        *_when(own.stopped, _NOT_EQUAL, _assign(own.counter, 0)),
        *_when(own.counter, _BIGGER, run, stand_still),
    ]
    report = [*_show_lamp(node, plan, own)]
    for number, chunk in enumerate(plan.chunks):
        report += [_EMIT | number, chunk.address, chunk.words]
    handlers[node.event(plan.tick_event)] = tick
    reading = node.event(plan.reading_event)
    handlers[reading] = [*handlers.get(reading, []), *report]
    words = _link(handlers)
    room = min(node.variable_words, _ADDRESSES)
    if len(words) > node.bytecode_words or own_words.stop > room:
        raise AsebaError(f"{node.name} has no room for the program that stops its wheels")
    return words


def _link(handlers: dict[int, list[int]]) -> tuple[int, ...]:
    """Return the table of events, and behind it their handlers."""
    table = [1 + 2 * len(handlers)]
    code: list[int] = []
    for event, handler in handlers.items():
        table += [event, table[0] + len(code)]
        code += [*handler, _STOP]
    return (*table, *code)


def _show_lamp(node: NodeDescription, plan: ProgramPlan, own: ProgramVariables) -> list[int]:
    if plan.lamp_native in node.natives:
        addresses = [word for address in reversed(own.lamp) for word in (_LARGE, address)]
        return [*addresses, _CALL | node.natives.index(plan.lamp_native)]
    pairs = zip(own.lamp, plan.lamp, strict=False)
    return [word for source, name in pairs for word in _copy(source, node.address(name))]


def _enable_words(node: NodeDescription, port: WordPort, own: ProgramVariables) -> list[int]:
    """Return words that switch the infrared on, and let it send nothing until the host says what."""
    call = [_LARGE, own.one, _CALL | node.natives.index(port.enable)]
    return [*_assign(own.one, 1), *_assign(port.sent, -1), *call]


def _assign(address: int, value: int) -> list[int]:
    return [_IMMEDIATE | (value & 0x0FFF), _STORE | address]


def _copy(source: int, target: int) -> list[int]:
    return [_LOAD | source, _STORE | target]


def _when(
    address: int, operator: int, then: Sequence[int], otherwise: Sequence[int] = ()
) -> list[int]:
    """Return words that compare a variable with 0. Branches are counted from the branch itself."""
    done = [_JUMP | (len(otherwise) + 1)] if otherwise else []
    compare = [_LOAD | address, _IMMEDIATE | 0, _BRANCH | operator]
    return [*compare, 2 + len(then) + len(done), *then, *done, *otherwise]
