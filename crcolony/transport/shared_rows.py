"""The memory that an arena shares with the robots on its machine: a page for each of them (`body/shared_pages.py`)."""

import contextlib
import fcntl
import mmap
import os

import numpy as np

from crcolony.body.contract import ACTION_WIDTH, OBSERVATION_WIDTH
from crcolony.body.shared_pages import (
    ACTION_AT,
    ACTION_WORDS,
    LATEST_ACTION,
    LATEST_OBSERVATION,
    NO_PAGE,
    NOTHING,
    OBSERVATION_AT,
    OBSERVATION_WORDS,
    PAGE_BYTES,
    PAGE_WORDS,
    ROW_AFTER,
    Pages,
    page_of,
)
from crcolony.compiled import FloatArray
from crcolony.protocol.body_messages import Contact
from crcolony.protocol.identity import ID_BYTES
from crcolony.transport.interface import LocalObservation


class RowPage:
    """The page of one robot."""

    def __init__(self, memory: memoryview) -> None:
        self._bytes = memory
        self._words = memory.cast("q")
        self.arrays = page_of(np.frombuffer(memory, dtype=np.int64))
        """The same, for compiled code"""
        numbers = self.arrays.numbers
        self._observations = [
            _row(numbers, OBSERVATION_AT + k * OBSERVATION_WORDS + ROW_AFTER, OBSERVATION_WIDTH)
            for k in (0, 1)
        ]
        self._actions = [
            _row(numbers, ACTION_AT + k * ACTION_WORDS + 1, ACTION_WIDTH) for k in (0, 1)
        ]

    # What the body's process does -----------------------------------------------------------------------------------

    def clear(self) -> None:
        """Make it a page without rows."""
        self._words[LATEST_OBSERVATION] = self._words[LATEST_ACTION] = NOTHING

    def write_observation(self, tick: int, row: FloatArray, contact: Contact | None) -> None:
        """Write the observation (OBSERVATION_WIDTH,) of a tick."""
        words, parity = self._words, tick & 1
        at = OBSERVATION_AT + parity * OBSERVATION_WORDS
        words[at] = NOTHING
        self._observations[parity][:] = row
        words[at + 1] = NOTHING
        if contact is not None:
            words[at + 1] = contact.nonce
            self._bytes[8 * (at + 2) : 8 * (at + 2) + ID_BYTES] = contact.robot
        words[at] = words[LATEST_OBSERVATION] = tick

    def read_action(self, after_tick: int) -> tuple[int, FloatArray] | None:
        """Return tick and row (ACTION_WIDTH,) of the latest action; None if there is none but that for `after_tick`."""
        words = self._words
        tick = words[LATEST_ACTION]
        at = ACTION_AT + (tick & 1) * ACTION_WORDS
        if tick in (NOTHING, after_tick) or words[at] != tick:
            return None
        row = self._actions[tick & 1].copy()
        return (tick, row) if words[at] == tick else None

    # What the robot does --------------------------------------------------------------------------------------------

    def read_observation(self) -> LocalObservation | None:
        """Return a copy of the latest observation; None if there is none, or the next one is just being written."""
        words = self._words
        tick = words[LATEST_OBSERVATION]
        at = OBSERVATION_AT + (tick & 1) * OBSERVATION_WORDS
        if tick == NOTHING or words[at] != tick:
            return None
        contact, nonce = None, words[at + 1]
        if nonce != NOTHING:
            robot = bytes(self._bytes[8 * (at + 2) : 8 * (at + 2) + ID_BYTES])
            contact = Contact(robot, nonce)
        observation = LocalObservation(tick, self._observations[tick & 1].copy(), contact)
        return observation if words[at] == tick else None

    def write_action(self, tick: int, row: FloatArray) -> None:
        """Write the action (ACTION_WIDTH,) that answers the observation of a tick."""
        words, parity = self._words, tick & 1
        at = ACTION_AT + parity * ACTION_WORDS
        words[at] = NOTHING
        self._actions[parity][:] = row
        words[at] = words[LATEST_ACTION] = tick


class SharedPages:
    """All pages of an arena, with as many slots. Raises OSError where there is no such memory.

    A page that was in use is used again as late as possible: the process that had it may not have noticed yet.
    """

    def __init__(self, slots: int) -> None:
        pages = 4 * slots + 16
        self.descriptor = _create(pages * PAGE_BYTES)
        memory = mmap.mmap(self.descriptor, pages * PAGE_BYTES)
        self._memory = memoryview(memory)
        words = np.frombuffer(memory, dtype=np.int64).reshape(pages, PAGE_WORDS)
        self.arrays = Pages(
            words, words.view(np.float64), np.full(slots, NO_PAGE), np.full(slots, NOTHING)
        )
        self._free = list(range(pages))

    def begin(self, slot: int) -> RowPage:
        """Give a slot a page, which is empty."""
        self.end(slot)
        number = self._free.pop(0)
        self.arrays.page_of[slot], self.arrays.taken[slot] = number, NOTHING
        page = RowPage(self._memory[number * PAGE_BYTES : (number + 1) * PAGE_BYTES])
        page.clear()
        return page

    def end(self, slot: int) -> None:
        """Take the page from a slot, if it has one."""
        page_of = self.arrays.page_of
        if page_of[slot] != NO_PAGE:
            self._free.append(int(page_of[slot]))
            page_of[slot] = NO_PAGE

    def close(self) -> None:
        """Close the descriptor; the memory lives as long as somebody uses it."""
        with contextlib.suppress(OSError):
            os.close(self.descriptor)


def map_page(descriptor: int, number: int) -> RowPage:
    """Return one page of an arena's memory; raises OSError and ValueError if there is no such page for ever."""
    if os.fstat(descriptor).st_size < (number + 1) * PAGE_BYTES:
        raise OSError("the memory has no such page")
    if not fcntl.fcntl(descriptor, fcntl.F_GET_SEALS) & fcntl.F_SEAL_SHRINK:
        raise OSError("the memory can be taken away again")
    return RowPage(memoryview(mmap.mmap(descriptor, PAGE_BYTES, offset=number * PAGE_BYTES)))


def _create(size_bytes: int) -> int:
    """Return the descriptor of memory that nobody can shrink, which would end whoever reads it."""
    descriptor = os.memfd_create("crcolony", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
    try:
        os.ftruncate(descriptor, size_bytes)
        seals = fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW | fcntl.F_SEAL_SEAL
        fcntl.fcntl(descriptor, fcntl.F_ADD_SEALS, seals)
    except OSError:
        os.close(descriptor)
        raise
    return descriptor


def _row(numbers: FloatArray, at: int, width: int) -> FloatArray:
    return numbers[at : at + width]
