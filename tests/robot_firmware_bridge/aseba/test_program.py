"""The uploaded program stops the wheels by itself, in every state in which a host can leave it."""

from dataclasses import replace

import pytest
from crcolony_bridge.aseba.ir_words import find_word_port
from crcolony_bridge.aseba.models import THYMIO
from crcolony_bridge.aseba.program import (
    Chunk,
    ProgramPlan,
    ProgramVariables,
    dead_man_program,
    plan_chunks,
)
from crcolony_bridge.aseba.protocol import EVENT_INIT, MAX_EVENT_WORDS, AsebaError
from hypothesis import given
from hypothesis import strategies as st

from tests.robot_firmware_bridge.aseba.nodes import E_PUCK_NODE, THYMIO_NODE, Node, SmallVm
from tests.robot_firmware_bridge.aseba.word_thymio import WORD_THYMIO

E_PUCK_PLAN = ProgramPlan(
    "ir_sensors",
    "ir_sensors",
    ("speed.left", "speed.right"),
    ("color.red", "color.green", "color.blue"),
    "",
    (Chunk(39, 8), Chunk(228, ProgramVariables.WORDS)),
)
THYMIO_PLAN = ProgramPlan(
    "motor", "prox", ("motor.left.target", "motor.right.target"), (), "leds.top", (Chunk(34, 7),)
)


class Robot:
    """A node with our program, in a virtual machine."""

    def __init__(self, node: Node, plan: ProgramPlan) -> None:
        self.node, self.plan = node.described, plan
        self.own = ProgramVariables(self.node.first_free_word)
        program = dead_man_program(self.node, plan, self.own)
        self.vm = SmallVm(program, self.node.variable_words)
        self.vm.variables = [7] * len(self.vm.variables)  # what a program before it has left
        assert self.vm.run(EVENT_INIT) == []

    def command(self, ticks: int, left: int, right: int) -> None:
        self.vm.variables[self.own.counter : self.own.counter + 3] = [ticks, left, right]

    def tick(self) -> tuple[int, int]:
        """Let a tick pass; return the speeds that the motors have then."""
        self.vm.run(self.node.event(self.plan.tick_event))
        return self.motors

    @property
    def motors(self) -> tuple[int, int]:
        left, right = (self.vm.variables[self.node.address(name)] for name in self.plan.motors)
        return left, right


@pytest.fixture(params=["e-puck", "Thymio"])
def robot(request: pytest.FixtureRequest) -> Robot:
    """Each kind of robot, with the program just started."""
    if request.param == "e-puck":
        return Robot(E_PUCK_NODE, E_PUCK_PLAN)
    return Robot(THYMIO_NODE, THYMIO_PLAN)


def test_the_wheels_stand_still_from_the_start_on(robot: Robot) -> None:
    """Whatever the program before has left in the variables."""
    assert robot.motors == (0, 0)
    assert [robot.tick() for _ in range(3)] == [(0, 0)] * 3


@pytest.mark.parametrize("ticks", [0, 1, 5, 50])
def test_a_command_lasts_for_its_ticks_and_no_longer(robot: Robot, ticks: int) -> None:
    """Though no further one follows."""
    robot.command(ticks, 300, -200)
    for _ in range(ticks):
        assert robot.tick() == (300, -200)
    assert robot.tick() == (0, 0)


def test_a_speed_that_somebody_else_sets_is_overwritten(robot: Robot) -> None:
    """At the next tick."""
    robot.vm.variables[robot.node.address(robot.plan.motors[0])] = 500
    assert robot.tick() == (0, 0)


def test_the_latch_stops_the_wheels_against_any_command(robot: Robot) -> None:
    """Also against those that come later."""
    robot.command(100, 300, 300)
    assert robot.tick() == (300, 300)
    robot.vm.variables[robot.own.stopped] = 1
    assert robot.tick() == (0, 0)
    robot.command(100, 300, 300)
    assert robot.tick() == (0, 0)
    robot.vm.variables[robot.own.stopped] = 0
    assert robot.tick() == (0, 0)


@given(st.integers(-32768, 32767), st.integers(-32768, 32767), st.integers(-500, 500))
def test_whatever_is_written_into_the_variables_the_wheels_stop(
    counter: int, stopped: int, speed: int
) -> None:
    """Within as many ticks as the counter says, at most."""
    robot = Robot(THYMIO_NODE, THYMIO_PLAN)
    robot.vm.variables[robot.own.stopped] = stopped
    robot.command(min(counter, 20), speed, speed)
    for _ in range(max(min(counter, 20), 0)):
        assert robot.tick() in ((speed, speed), (0, 0))
    assert robot.tick() == (0, 0)


def test_ticks_are_counted_and_wrap() -> None:
    """The robot's own clock."""
    robot = Robot(E_PUCK_NODE, E_PUCK_PLAN)
    robot.vm.variables[robot.own.ticks] = 32766
    counts = []
    for _ in range(3):
        robot.tick()
        counts.append(robot.vm.variables[robot.own.ticks])
    assert counts == [32767, -32768, -32767]


def test_a_reading_is_emitted_with_one_event_a_chunk() -> None:
    """In order, and within the tick if there is no other event for it."""
    robot = Robot(E_PUCK_NODE, E_PUCK_PLAN)
    robot.vm.variables[39:47] = range(8)
    emitted = robot.vm.run(robot.node.event("ir_sensors"))
    assert [event for event, _ in emitted] == [0, 1]
    assert emitted[0][1] == list(range(8))
    assert len(emitted[1][1]) == ProgramVariables.WORDS


def test_the_lamp_is_a_variable_or_a_native_function() -> None:
    """A native function takes the addresses of red, green and blue, red on top of the stack."""
    e_puck = Robot(E_PUCK_NODE, E_PUCK_PLAN)
    e_puck.vm.variables[e_puck.own.lamp[0] : e_puck.own.lamp[0] + 3] = [10, 20, 30]
    e_puck.tick()
    assert [e_puck.vm.variables[e_puck.node.address(f"color.{c}")] for c in ("red", "blue")] == [
        10,
        30,
    ]
    thymio = Robot(THYMIO_NODE, THYMIO_PLAN)
    thymio.vm.run(thymio.node.event("prox"))
    assert thymio.vm.called == [(1, list(reversed(thymio.own.lamp)))]


def test_infrared_that_carries_words_is_silent_at_first_and_tells_each_word_at_once() -> None:
    """The native function gets the address of a variable that is 1; the word's event is behind those of the chunks."""
    node = WORD_THYMIO.described
    port = find_word_port(THYMIO.ir_words, node)
    assert port is not None
    thymio = Robot(WORD_THYMIO, replace(THYMIO_PLAN, words=port))
    ((native, stack),) = thymio.vm.called
    assert node.natives[native] == "prox.comm.enable"
    assert [thymio.vm.variables[address] for address in stack] == [1]
    assert thymio.vm.variables[port.sent] == -1
    thymio.vm.variables[port.received] = 0x7AB
    assert thymio.vm.run(node.event("prox.comm")) == [(1, [0x7AB])]
    thymio.command(2, 300, 300)
    assert [thymio.tick() for _ in range(3)] == [(300, 300), (300, 300), (0, 0)]


def test_a_robot_without_room_for_the_program_is_refused() -> None:
    """It is not driven without it."""
    for node in (
        Node("e-puck0", E_PUCK_NODE.variables, E_PUCK_NODE.events, bytecode_words=20),
        Node("e-puck0", E_PUCK_NODE.variables, E_PUCK_NODE.events, free_words=4),
    ):
        with pytest.raises(AsebaError, match="no room for the program that stops its wheels"):
            Robot(node, E_PUCK_PLAN)


@given(st.lists(st.tuples(st.integers(0, 600), st.integers(1, 200)), min_size=1, max_size=6))
def test_chunks_hold_every_variable_and_fit_into_a_message(spans: list[tuple[int, int]]) -> None:
    """In whatever order, overlapping or not."""
    chunks = plan_chunks(spans)
    held = {address for c in chunks for address in range(c.address, c.address + c.words)}
    assert {a for address, words in spans for a in range(address, address + words)} <= held
    assert max(chunk.words for chunk in chunks) <= MAX_EVENT_WORDS
