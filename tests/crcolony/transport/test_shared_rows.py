"""Memory that an arena shares: rows arrive whole, pages are used again late, and nobody can take the memory away."""

import mmap
import os
import sys
import threading
from collections.abc import Iterator

import numpy as np
import pytest

from crcolony.body.contract import ACTION_WIDTH, OBSERVATION_WIDTH
from crcolony.body.shared_pages import NO_PAGE, NOTHING, PAGE_BYTES
from crcolony.protocol.body_messages import Contact
from crcolony.protocol.identity import seeded
from crcolony.transport.local_socket import HAS_LOCAL_LINKS
from crcolony.transport.shared_rows import RowPage, SharedPages, map_page

pytestmark = pytest.mark.skipif(not HAS_LOCAL_LINKS, reason="there is no such memory here")
PEER = seeded("test", 1, 0).id


@pytest.fixture
def memory() -> Iterator[SharedPages]:
    memory = SharedPages(2)
    yield memory
    memory.close()


def mapped(memory: SharedPages, slot: int) -> RowPage:
    """Return a slot's page as the robot's process has it."""
    return map_page(memory.descriptor, int(memory.arrays.page_of[slot]))


def test_both_ends_have_the_same_page(memory: SharedPages) -> None:
    """Each reads what the other has written; an empty page says nothing."""
    arena = memory.begin(1)
    robot = mapped(memory, 1)
    assert robot.read_observation() is None
    assert arena.read_action(NOTHING) is None
    rng = np.random.default_rng(1)
    for tick in (0, 1, 2, 5, 6, 2**40, 2**40 + 1):
        row, action = rng.random(OBSERVATION_WIDTH), rng.random(ACTION_WIDTH)
        contact = Contact(PEER, tick) if tick % 3 else None
        arena.write_observation(tick, row, contact)
        robot.write_action(tick, action)
        seen = robot.read_observation()
        assert seen is not None
        assert (seen.tick, seen.contact) == (tick, contact)
        assert np.array_equal(seen.row, row)
        acted = arena.read_action(NOTHING)
        assert acted is not None
        assert acted[0] == tick
        assert np.array_equal(acted[1], action)
        assert arena.read_action(tick) is None, "it was read before"


def test_what_was_read_is_a_copy(memory: SharedPages) -> None:
    """The next row does not change it."""
    page = memory.begin(0)
    page.write_observation(2, np.zeros(OBSERVATION_WIDTH), None)
    page.write_action(2, np.zeros(ACTION_WIDTH))
    seen, acted = page.read_observation(), page.read_action(NOTHING)
    page.write_observation(4, np.ones(OBSERVATION_WIDTH), None)
    page.write_action(4, np.ones(ACTION_WIDTH))
    assert seen is not None
    assert acted is not None
    assert not seen.row.any()
    assert not acted[1].any()


@pytest.fixture
def _restless() -> Iterator[None]:
    """Let threads take turns after every few instructions."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


def read_until(robot: RowPage, arena: RowPage, rows: int) -> None:
    """Read so many rows in each direction, whose numbers must all be their tick."""
    seen = acted = 0
    last = NOTHING
    while min(seen, acted) < rows:
        observation = robot.read_observation()
        if observation is not None:
            seen += 1
            assert (observation.row == observation.tick).all()
            assert observation.contact is not None
            assert observation.contact.nonce == observation.tick
            assert int.from_bytes(observation.contact.robot, "little") == observation.tick
        action = arena.read_action(last)
        if action is not None:
            acted += 1
            last, row = action
            assert (row == last).all()


@pytest.mark.usefixtures("_restless")
def test_no_torn_row_is_ever_read(memory: SharedPages) -> None:
    """While another thread writes on and on: all numbers of a row are those of its tick, in both directions."""
    arena, stopped = memory.begin(0), threading.Event()
    robot = mapped(memory, 0)

    def write() -> None:
        tick = 0
        while not stopped.is_set():
            tick += 1
            contact = Contact(tick.to_bytes(len(PEER), "little"), tick)
            arena.write_observation(tick, np.full(OBSERVATION_WIDTH, tick), contact)
            robot.write_action(tick, np.full(ACTION_WIDTH, tick))

    writing = threading.Thread(target=write)
    writing.start()
    try:
        read_until(robot, arena, rows=2000)
    finally:
        stopped.set()
        writing.join()


def test_pages_are_used_again_as_late_as_possible(memory: SharedPages) -> None:
    """A process that was replaced may write on into its own for a while, and nobody reads that."""
    pages = len(memory.arrays.words)
    used = []
    for _ in range(3 * pages):
        memory.begin(0)
        used.append(int(memory.arrays.page_of[0]))
    for at in range(len(used) - pages):
        assert len(set(used[at : at + pages])) == pages


def test_slots_never_have_the_same_page() -> None:
    """However they come and go, there is one for each of them; a slot that has ended has none."""
    memory = SharedPages(8)
    rng = np.random.default_rng(3)
    for _ in range(2000):
        slot = int(rng.integers(8))
        (memory.begin if rng.random() < 0.6 else memory.end)(slot)
        used = memory.arrays.page_of[memory.arrays.page_of != NO_PAGE]
        assert len(set(used.tolist())) == len(used)
    for slot in range(8):
        memory.end(slot)
        memory.end(slot)
    assert (memory.arrays.page_of == NO_PAGE).all()
    memory.close()


def test_a_page_that_is_not_there_is_refused(memory: SharedPages) -> None:
    """Instead of a process that is killed when it reads it."""
    pages = len(memory.arrays.words)
    map_page(memory.descriptor, pages - 1)
    for number in (pages, 2**32 - 1):
        with pytest.raises(OSError, match="no such page"):
            map_page(memory.descriptor, number)


def test_what_is_no_such_memory_is_refused() -> None:
    """A pipe, and memory that its owner could shrink."""
    out, into = os.pipe()
    unsealed = os.memfd_create("unsealed", os.MFD_CLOEXEC)
    os.ftruncate(unsealed, 4 * PAGE_BYTES)
    for descriptor in (out, unsealed):
        with pytest.raises(OSError):
            map_page(descriptor, 0)
    for descriptor in (out, into, unsealed):
        os.close(descriptor)


def test_nobody_can_shrink_the_memory(memory: SharedPages) -> None:
    """A robot has the descriptor, too; nor can it grow it, or allow itself to."""
    for size_bytes in (0, PAGE_BYTES, 2**20):
        with pytest.raises(PermissionError):
            os.ftruncate(memory.descriptor, size_bytes)
    with pytest.raises(PermissionError):
        os.truncate(f"/proc/self/fd/{memory.descriptor}", 0)


def test_the_memory_lives_as_long_as_somebody_uses_it() -> None:
    """A robot that has not noticed yet that its arena has ended writes on without harm."""
    memory = SharedPages(1)
    memory.begin(0)
    robot = mapped(memory, 0)
    memory.close()
    memory.close()
    del memory
    robot.write_action(1, np.ones(ACTION_WIDTH))
    acted = robot.read_action(NOTHING)
    assert acted is not None
    assert acted[1].all()
    assert mmap.ALLOCATIONGRANULARITY <= PAGE_BYTES


def test_the_memory_has_no_name_in_any_folder(memory: SharedPages) -> None:
    """So that nothing is left of it, however a process ends."""
    target = os.readlink(f"/proc/self/fd/{memory.descriptor}")
    assert target == "/memfd:crcolony (deleted)"
