"""The memory that a robot and its body share on one machine: the latest observations and actions.

Each side writes its own half. A row lies in one of two places, by whether its tick is even or odd, so that the reader
of the newest one is not in the way of the writer of the next. The tick of a row is written after the row, and read
before and after it.
"""

import fcntl
import mmap
import os

import numpy as np

from crcolony.body.contract import ACTION_WIDTH, OBSERVATION_WIDTH
from crcolony.compiled import FloatArray
from crcolony.protocol.body_messages import Contact
from crcolony.protocol.identity import ID_BYTES
from crcolony.transport.interface import LocalAction, LocalObservation

LAYOUT = 1
"""Version of what lies where: a robot and a body with different ones do not share memory."""

_NO_TICK = -1
_NO_CONTACT = -1
_HEADER_WORDS = 1
"""The latest tick"""
_OBSERVATION_WORDS = 2 + ID_BYTES // 8 + OBSERVATION_WIDTH
"""Tick, nonce of the contact, id of the robot that was met, row"""
_ACTION_WORDS = 1 + ACTION_WIDTH
"""Tick, row"""
_ACTIONS_AT = _HEADER_WORDS + 2 * _OBSERVATION_WORDS
_BYTES = 8 * (_ACTIONS_AT + _HEADER_WORDS + 2 * _ACTION_WORDS)


class SharedRows:
    """One robot's and its body's memory, behind a file descriptor. Raises OSError if that is none of this size."""

    def __init__(self, descriptor: int) -> None:
        if os.fstat(descriptor).st_size != _BYTES:
            raise OSError("the shared memory has another size")
        memory = mmap.mmap(descriptor, _BYTES)
        self._memory = memory
        self._words = memoryview(memory).cast("q")
        self._observations = [
            _row(memory, _HEADER_WORDS + k * _OBSERVATION_WORDS + 4, OBSERVATION_WIDTH)
            for k in (0, 1)
        ]
        self._actions = [
            _row(memory, _ACTIONS_AT + _HEADER_WORDS + k * _ACTION_WORDS + 1, ACTION_WIDTH)
            for k in (0, 1)
        ]
        self._acted = _NO_TICK
        """The tick of the last action that was taken"""

    def publish_observation(self, tick: int, row: FloatArray, contact: Contact | None) -> None:
        """Write the observation (OBSERVATION_WIDTH,) of a tick."""
        words, parity = self._words, tick & 1
        at = _HEADER_WORDS + parity * _OBSERVATION_WORDS
        words[at] = _NO_TICK
        self._observations[parity][:] = row
        words[at + 1] = _NO_CONTACT
        if contact is not None:
            words[at + 1] = contact.nonce
            self._memory[8 * (at + 2) : 8 * (at + 2) + ID_BYTES] = contact.robot
        words[at] = tick
        words[0] = tick

    def observation(self) -> LocalObservation | None:
        """Return a copy of the latest observation; None if there is none, or the next one is just being written."""
        words = self._words
        tick = words[0]
        at = _HEADER_WORDS + (tick & 1) * _OBSERVATION_WORDS
        if tick == _NO_TICK or words[at] != tick:
            return None
        contact = None
        nonce = words[at + 1]
        if nonce != _NO_CONTACT:
            contact = Contact(self._memory[8 * (at + 2) : 8 * (at + 2) + ID_BYTES], nonce)
        observed = LocalObservation(tick, self._observations[tick & 1].copy(), contact)
        return observed if words[at] == tick else None

    def publish_action(self, tick: int, row: FloatArray) -> None:
        """Write the action (ACTION_WIDTH,) that answers the observation of a tick."""
        words, parity = self._words, tick & 1
        at = _ACTIONS_AT + _HEADER_WORDS + parity * _ACTION_WORDS
        words[at] = _NO_TICK
        self._actions[parity][:] = row
        words[at] = tick
        words[_ACTIONS_AT] = tick

    def take_action(self, robot: bytes) -> LocalAction | None:
        """Return a copy of the latest action, which is the robot's; None if there is none since the last call."""
        words = self._words
        tick = words[_ACTIONS_AT]
        at = _ACTIONS_AT + _HEADER_WORDS + (tick & 1) * _ACTION_WORDS
        if tick == self._acted or words[at] != tick:
            return None
        action = LocalAction(robot, tick, self._actions[tick & 1].copy())
        if words[at] != tick:
            return None
        self._acted = tick
        return action


def create_shared_memory() -> int:
    """Return the descriptor of new memory, which nobody can shrink: that would end whoever reads it."""
    descriptor = os.memfd_create("crcolony", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
    try:
        os.ftruncate(descriptor, _BYTES)
        fcntl.fcntl(
            descriptor,
            fcntl.F_ADD_SEALS,
            fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW | fcntl.F_SEAL_SEAL,
        )
        for word in (0, _ACTIONS_AT):
            os.pwrite(descriptor, _NO_TICK.to_bytes(8, "little", signed=True), 8 * word)
    except OSError:
        os.close(descriptor)
        raise
    return descriptor


def _row(memory: mmap.mmap, word: int, width: int) -> FloatArray:
    return np.frombuffer(memory, dtype=np.float64, count=width, offset=8 * word)
