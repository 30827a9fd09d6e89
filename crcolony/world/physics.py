"""Rigid bodies (the world of thesis 4.6): pymunk builds and owns the space, compiled code steps it.

pymunk wraps the C library Chipmunk and exports its functions. Compiled code calls them by name, so
a tick never returns to Python; `Space.step_from_python` makes the same calls through pymunk's own
binding, for tests.

Chipmunk moves bodies first and resolves contacts afterwards, and it carries contact forces from
step to step. Here the order is reversed and the forces are cleared: the next poses depend on
nothing but the poses and the wheels, so that an arena can be saved and restored at any moment
without changing its future.

1. Contact forces of earlier steps are cleared. Velocities are set to zero and wheel speeds are
   given as forces (with damping 0 a body has no momentum of its own: its wheels grip the ground).
2. `cpSpaceStep` moves nothing, finds the contacts at the present poses, and turns forces into
   velocities that respect them.
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

_Field = pymunk.batch.BodyFields
_COMMAND = (
    _Field.POSITION
    | _Field.ANGLE
    | _Field.VELOCITY
    | _Field.ANGULAR_VELOCITY
    | _Field.FORCE
    | _Field.TORQUE
)
_STATE = _Field.POSITION | _Field.ANGLE | _Field.VELOCITY | _Field.ANGULAR_VELOCITY
_COMMAND_WIDTH = 9
"""Numbers of a body in the command batch."""
_STATE_WIDTH = 6
"""Numbers of a body in the state batch."""
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


class Physics(NamedTuple):
    """What compiled code needs of a space: addresses, and the arrays of Chipmunk's batch calls."""

    addresses: NDArray[np.uint64]
    """(6,) space, command reader, command data, state writer, state data, contact clearer"""
    bodies: NDArray[np.uint64]
    """(robots,) addresses of the bodies"""
    command: FloatArray
    """Poses, velocities, forces and torques that Chipmunk reads before a step"""
    command_count: NDArray[np.int32]
    """(1,) how many of these numbers Chipmunk has read"""
    state: FloatArray
    """Poses and velocities that Chipmunk writes after a step"""
    state_count: NDArray[np.int32]
    """(1,) how many of these numbers Chipmunk has written"""
    inertia: FloatArray
    """(2,) mass (kg), moment (kg m^2)"""


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
        moment = pymunk.moment_for_circle(mass_kg, 0.0, radius_m)
        self.space = _empty_space(4.0 * radius_m, robots, step_s)
        for x1, y1, x2, y2 in walls.tolist():
            self.space.add(pymunk.Segment(self.space.static_body, (x1, y1), (x2, y2), 0.0))
        for x, y, pillar_radius_m in pillars.tolist():
            self.space.add(pymunk.Circle(self.space.static_body, pillar_radius_m, (x, y)))
        self.bodies = [pymunk.Body(mass_kg, moment) for _ in range(robots)]
        for body in self.bodies:
            self.space.add(body, pymunk.Circle(body, radius_m))
        self._command = _Batch(_COMMAND.value, robots * _COMMAND_WIDTH)
        self._state = _Batch(_STATE.value, robots * _STATE_WIDTH)
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
            inertia=np.array([mass_kg, moment]),
        )

    def step_from_python(self, step_s: float) -> None:
        """Do what `step_physics` does, through pymunk's own binding."""
        pymunk.batch.set_space_bodies(self.space, _COMMAND, self._command.buffer)
        clear = _ffi.cast("cpArbiterIteratorFunc", _clear_contact.address)
        _lib.cpSpaceEachCachedArbiter(self.space._space, clear, _ffi.NULL)
        _lib.cpSpaceStep(self.space._space, step_s)
        for body in self.bodies:
            _lib.cpBodyUpdatePosition(body._body, step_s)
        self._state.count[0] = 0
        pymunk.batch.get_space_bodies(self.space, _STATE, self._state.buffer)


class _Batch:
    """One of pymunk's batch buffers over memory that numpy owns, with its counter as an array."""

    def __init__(self, fields: int, size: int) -> None:
        self.floats = np.zeros(size + _SPARE)
        self.buffer = pymunk.batch.Buffer()
        self.buffer.set_float_buf(self.floats)
        self.data = _ffi.new("pmBatchedData *")
        self.data.fields = fields
        self.data.floatArray = self.buffer._float_arr
        self.data.intArray = self.buffer._int_arr
        number = _ffi.buffer(_ffi.addressof(self.buffer._float_arr, "num"), 4)
        self.count: NDArray[np.int32] = np.frombuffer(number, dtype=np.int32)


def _empty_space(cell_m: float, robots: int, step_s: float) -> pymunk.Space:
    space = pymunk.Space()
    space.damping = 0.0
    space.iterations = _SOLVER_ITERATIONS
    space.collision_slop = 0.001
    space.collision_bias = _OVERLAP_LEFT ** (1.0 / step_s)
    space.use_spatial_hash(cell_m, max(40, 10 * robots))
    return space


def _as_address(pointer: Any) -> int:
    return int(_ffi.cast("uintptr_t", pointer))


@compiled
def write_commands(
    physics: Physics, poses: FloatArray, wheel_speeds: FloatArray, track_m: float, step_s: float
) -> None:
    """Write what a physics step starts from: poses (robots, 3), and wheel speeds (robots, 2) (m/s)
    as forces.

    The force points along the heading at the middle of the step, which makes a free robot follow
    its arc exactly.
    """
    mass_kg, moment = physics.inertia[0], physics.inertia[1]
    for i in range(poses.shape[0]):
        speed = 0.5 * (wheel_speeds[i, 0] + wheel_speeds[i, 1])
        turn = (wheel_speeds[i, 1] - wheel_speeds[i, 0]) / track_m
        middle = poses[i, 2] + 0.5 * turn * step_s
        force = speed * mass_kg / step_s
        at = i * _COMMAND_WIDTH
        physics.command[at] = poses[i, 0]
        physics.command[at + 1] = poses[i, 1]
        physics.command[at + 2] = poses[i, 2]
        physics.command[at + 3] = 0.0
        physics.command[at + 4] = 0.0
        physics.command[at + 5] = 0.0
        physics.command[at + 6] = force * math.cos(middle)
        physics.command[at + 7] = force * math.sin(middle)
        physics.command[at + 8] = turn * moment / step_s


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
def read_states(physics: Physics, poses: FloatArray, velocities: FloatArray) -> None:
    """Read poses (x, y in m, heading in (-pi, pi]) and velocities (m/s, m/s, rad/s), (robots, 3)
    each."""
    for i in range(poses.shape[0]):
        at = i * _STATE_WIDTH
        heading = physics.state[at + 2]
        if heading > math.pi:
            heading -= 2.0 * math.pi
        elif heading <= -math.pi:
            heading += 2.0 * math.pi
        poses[i, 0] = physics.state[at]
        poses[i, 1] = physics.state[at + 1]
        poses[i, 2] = heading
        velocities[i, 0] = physics.state[at + 3]
        velocities[i, 1] = physics.state[at + 4]
        velocities[i, 2] = physics.state[at + 5]
