"""Rigid bodies (the world of thesis 4.6): pymunk builds and owns the space, compiled code steps it.

pymunk wraps the C library Chipmunk and exports its functions. Compiled code calls them by name, so
a tick never returns to Python; `Space.step_from_python` makes the same calls through pymunk's own
binding, for tests.

Chipmunk moves bodies first and resolves contacts afterwards, and it carries contact forces from
step to step. Here the order is reversed and the forces are cleared: the next poses depend on
nothing but the poses and the wheels, so that an arena can be saved and restored at any moment
without changing its future. Chipmunk is asked for nothing but contacts: the bodies are discs
without friction, which no contact turns (their moment is infinite, or rounding would turn them), and
headings follow from the wheels alone.

1. Contact forces of earlier steps are cleared. Every body gets its place, and the velocity that its
   wheels want; it has no momentum of its own, because its wheels grip the ground.
2. `cpSpaceStep` moves nothing, finds the contacts at the present places, and turns velocities into
   ones that respect them.
3. `cpBodyUpdatePosition` moves every body by that velocity and pushes overlapping bodies apart.

A spatial hash, filled again in every step, keeps the order of contacts independent of the past.
"""

import math
from typing import Any, NamedTuple

import numpy as np
import pymunk
import pymunk.batch
from llvmlite import binding  # type: ignore[import-untyped]
from numba import carray, cfunc, types  # type: ignore[attr-defined]
from numpy.typing import NDArray
from pymunk import _chipmunk, _chipmunk_cffi

from crcolony.compiled import FloatArray, compiled

_ffi: Any = _chipmunk_cffi.ffi
_lib: Any = _chipmunk_cffi.lib

binding.load_library_permanently(_chipmunk.__file__)

_address, _number = types.uintp, types.float64


def _external(name: str, *arguments: types.Type) -> Any:
    if binding.address_of_symbol(name) is None:
        raise ImportError(f"this build of pymunk hides {name}; install pymunk from its wheel")
    return types.ExternalFunction(name, types.void(*arguments))


_step_space = _external("cpSpaceStep", _address, _number)
_each_body = _external("cpSpaceEachBody", _address, _address, _address)
_each_contact = _external("cpSpaceEachCachedArbiter", _address, _address, _address)
_move_body = _external("cpBodyUpdatePosition", _address, _number)

_FIELDS = pymunk.batch.BodyFields.POSITION | pymunk.batch.BodyFields.VELOCITY
_WIDTH = 4
"""Numbers of a body in a batch."""
_SPARE = 64
"""Room beyond a batch: Chipmunk reallocates a full array, which must not happen to memory that
numpy owns."""

_SOLVER_ITERATIONS = 4
"""Enough for round bodies that push one another; more costs time and changes little."""

_OVERLAP_LEFT = 0.05
"""Share of an overlap that is left after one step."""

_COUNT_OFFSET = _ffi.offsetof("cpArbiter", "count") // 4
"""Place of the number of contact points in a `cpArbiter`, in 32-bit integers."""

_contact: Any = types.CPointer(types.int32)  # type: ignore[no-untyped-call]


@cfunc(types.void(_contact, _address))
def _clear_contact(arbiter: Any, _data: int) -> None:
    """Remove the points of a contact, so that Chipmunk has no force to carry over."""
    carray(arbiter, (_COUNT_OFFSET + 1,))[_COUNT_OFFSET] = 0


@cfunc(types.void(_address, _number))
def _stay(_body: int, _step_s: float) -> None:
    """Move a body by nothing, where Chipmunk would move it before it resolves contacts."""


class Physics(NamedTuple):
    """What compiled code needs of a space: addresses, and the arrays of Chipmunk's batch calls."""

    addresses: NDArray[np.uint64]
    """(6,) space, command reader, command data, state writer, state data, contact clearer"""
    bodies: NDArray[np.uint64]
    """(robots,) addresses of the bodies"""
    command: FloatArray
    """Places and velocities that Chipmunk reads before a step"""
    command_count: NDArray[np.int32]
    """(1,) how many of these numbers Chipmunk has read"""
    state: FloatArray
    """Places and velocities that Chipmunk writes after a step"""
    state_count: NDArray[np.int32]
    """(1,) how many of these numbers Chipmunk has written"""


class Space:
    """A pymunk space with one round body for every robot, and the walls and pillars around them.

    `walls` (n, 4) are from x, y to x, y, `pillars` (n, 3) are x, y, radius (m).
    """

    def __init__(
        self,
        robots: int,
        radius_m: float,
        mass_kg: float,
        walls: FloatArray,
        pillars: FloatArray,
        step_s: float,
    ) -> None:
        self.space = _empty_space(4.0 * radius_m, robots, step_s)
        for x1, y1, x2, y2 in walls.tolist():
            self.space.add(pymunk.Segment(self.space.static_body, (x1, y1), (x2, y2), 0.0))
        for x, y, pillar_radius_m in pillars.tolist():
            self.space.add(pymunk.Circle(self.space.static_body, pillar_radius_m, (x, y)))
        self.bodies = [pymunk.Body(mass_kg, math.inf) for _ in range(robots)]
        stay = _ffi.cast("cpBodyPositionFunc", _stay.address)
        for body in self.bodies:
            self.space.add(body, pymunk.Circle(body, radius_m))
            _lib.cpBodySetPositionUpdateFunc(body._body, stay)
        self._command = _Batch(robots)
        self._state = _Batch(robots)
        self.physics = Physics(
            addresses=np.array(
                [
                    _as_address(self.space._space),
                    _as_address(_ffi.addressof(_lib, "pmSpaceBodySetIteratorFuncBatched")),
                    _as_address(self._command.data),
                    _as_address(_ffi.addressof(_lib, "pmSpaceBodyGetIteratorFuncBatched")),
                    _as_address(self._state.data),
                    _clear_contact.address,
                ],
                dtype=np.uint64,
            ),
            bodies=np.array([_as_address(body._body) for body in self.bodies], dtype=np.uint64),
            command=self._command.floats,
            command_count=self._command.count,
            state=self._state.floats,
            state_count=self._state.count,
        )

    def step_from_python(self, step_s: float) -> None:
        """Do what `step_physics` does, through pymunk's own binding."""
        pymunk.batch.set_space_bodies(self.space, _FIELDS, self._command.buffer)
        clear = _ffi.cast("cpArbiterIteratorFunc", _clear_contact.address)
        _lib.cpSpaceEachCachedArbiter(self.space._space, clear, _ffi.NULL)
        _lib.cpSpaceStep(self.space._space, step_s)
        for body in self.bodies:
            _lib.cpBodyUpdatePosition(body._body, step_s)
        self._state.count[0] = 0
        pymunk.batch.get_space_bodies(self.space, _FIELDS, self._state.buffer)


class _Batch:
    """One of pymunk's batch buffers over memory that numpy owns, with its counter as an array."""

    def __init__(self, bodies: int) -> None:
        self.floats = np.zeros(bodies * _WIDTH + _SPARE)
        self.buffer = pymunk.batch.Buffer()
        self.buffer.set_float_buf(self.floats)
        self.data = _ffi.new("pmBatchedData *")
        self.data.fields = _FIELDS.value
        self.data.floatArray = self.buffer._float_arr
        self.data.intArray = self.buffer._int_arr
        number = _ffi.buffer(_ffi.addressof(self.buffer._float_arr, "num"), 4)
        self.count: NDArray[np.int32] = np.frombuffer(number, dtype=np.int32)


def _empty_space(cell_m: float, robots: int, step_s: float) -> pymunk.Space:
    space = pymunk.Space()
    space.collision_persistence = 1
    space.iterations = _SOLVER_ITERATIONS
    space.collision_slop = 0.001
    space.collision_bias = _OVERLAP_LEFT ** (1.0 / step_s)
    space.use_spatial_hash(cell_m, max(40, 10 * robots))
    return space


def _as_address(pointer: Any) -> int:
    return int(_ffi.cast("uintptr_t", pointer))


@compiled
def move_bodies(
    physics: Physics,
    poses: FloatArray,
    velocities: FloatArray,
    wheel_speeds: FloatArray,
    track_m: float,
    step_s: float,
) -> None:
    """Do one physics step: poses (x, y in m, heading in (-pi, pi]) and velocities (m/s, m/s, rad/s),
    (robots, 3) each, follow from wheel speeds (robots, 2) (m/s)."""
    write_commands(physics, poses, wheel_speeds, track_m, step_s)
    step_physics(physics, step_s)
    read_states(physics, poses, velocities, wheel_speeds, track_m, step_s)


@compiled
def write_commands(
    physics: Physics, poses: FloatArray, wheel_speeds: FloatArray, track_m: float, step_s: float
) -> None:
    """Write what a physics step starts from: places of poses (robots, 3), and the velocities that
    wheel speeds (robots, 2) (m/s) want.

    A velocity points along the heading at the middle of the step, which makes a free robot follow
    its arc exactly.
    """
    for i in range(poses.shape[0]):
        speed = 0.5 * (wheel_speeds[i, 0] + wheel_speeds[i, 1])
        middle = poses[i, 2] + 0.5 * step_s * _turn(wheel_speeds, i, track_m)
        at = i * _WIDTH
        physics.command[at] = poses[i, 0]
        physics.command[at + 1] = poses[i, 1]
        physics.command[at + 2] = speed * math.cos(middle)
        physics.command[at + 3] = speed * math.sin(middle)


@compiled
def _turn(wheel_speeds: FloatArray, i: int, track_m: float) -> float:
    """Return how fast the wheels turn robot i (rad/s)."""
    turn: float = (wheel_speeds[i, 1] - wheel_speeds[i, 0]) / track_m
    return turn


@compiled
def step_physics(physics: Physics, step_s: float) -> None:
    """Do one step of Chipmunk: clear contacts, resolve contacts, move (see the top of this
    file)."""
    addresses = physics.addresses
    physics.command_count[0] = 0
    _each_body(addresses[0], addresses[1], addresses[2])
    _each_contact(addresses[0], addresses[5], addresses[0])
    _step_space(addresses[0], step_s)
    for i in range(physics.bodies.shape[0]):
        _move_body(physics.bodies[i], step_s)
    physics.state_count[0] = 0
    _each_body(addresses[0], addresses[3], addresses[4])


@compiled
def read_states(
    physics: Physics,
    poses: FloatArray,
    velocities: FloatArray,
    wheel_speeds: FloatArray,
    track_m: float,
    step_s: float,
) -> None:
    """Read poses (x, y in m, heading in (-pi, pi]) and velocities (m/s, m/s, rad/s), (robots, 3)
    each, after a step with these wheel speeds."""
    for i in range(poses.shape[0]):
        turn = _turn(wheel_speeds, i, track_m)
        heading = poses[i, 2] + step_s * turn
        if heading > math.pi:
            heading -= 2.0 * math.pi
        elif heading <= -math.pi:
            heading += 2.0 * math.pi
        at = i * _WIDTH
        poses[i, 0] = physics.state[at]
        poses[i, 1] = physics.state[at + 1]
        poses[i, 2] = heading
        velocities[i, 0] = physics.state[at + 2]
        velocities[i, 1] = physics.state[at + 3]
        velocities[i, 2] = turn
