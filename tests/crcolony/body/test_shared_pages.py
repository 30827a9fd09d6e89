"""What an arena and its robots say to each other through shared memory is what they would say over the network."""

import mmap
from collections.abc import Iterator
from dataclasses import dataclass
from math import inf, nan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crcolony.body import contract
from crcolony.body.contract import ACTION_WIDTH, OBSERVATION_WIDTH
from crcolony.body.shared_pages import ACTION_AT, ACTION_WORDS, PAGE_BYTES, PAGE_WORDS, no_pages
from crcolony.compiled import FloatArray
from crcolony.nodes.arena_node import ArenaNode
from crcolony.transport.shared_rows import RowPage, SharedPages
from tests.support.arena_nodes import ARENA_RUN, IDS, filled_node, join, new_node
from tests.support.small_colony import small

SLOTS = 4
PERIOD_S = small().arena.control_period_s
WITHOUT_PAGE = 3
"""The slot of a robot on another machine"""


@dataclass
class Machine:
    """An arena whose robots, but one, are on its machine."""

    node: ArenaNode
    memory: SharedPages
    pages: list[RowPage]


@pytest.fixture
def memory() -> Iterator[SharedPages]:
    memory = SharedPages(SLOTS)
    yield memory
    memory.close()


@pytest.fixture
def here(memory: SharedPages) -> Machine:
    pages = [memory.begin(slot) for slot in range(SLOTS) if slot != WITHOUT_PAGE]
    return Machine(filled_node(), memory, pages)


def rows(width: int, low: float, high: float) -> st.SearchStrategy[FloatArray]:
    """Return rows with numbers in and beyond some limits, and sometimes one that is not finite."""
    number = st.one_of(st.floats(low, high), st.sampled_from([0.0, 1.0, -1e300, 1e300]))
    strange = st.tuples(st.integers(0, width - 1), st.sampled_from([nan, inf, -inf]))

    def with_strange(drawn: tuple[list[float], tuple[int, float] | None]) -> FloatArray:
        row = np.array(drawn[0])
        if drawn[1] is not None:
            row[drawn[1][0]] = drawn[1][1]
        return row

    numbers = st.lists(number, min_size=width, max_size=width)
    return st.tuples(numbers, st.none() | st.none() | strange).map(with_strange)


def test_a_page_is_one_of_this_machine_and_holds_all_rows() -> None:
    """A part of memory can be shared by itself wherever pages are larger, as on some ARM boards."""
    assert PAGE_BYTES % mmap.ALLOCATIONGRANULARITY == 0
    assert ACTION_AT + 2 * ACTION_WORDS <= PAGE_WORDS


# Observations ---------------------------------------------------------------------------------------------------------


@st.composite
def observed(draw: st.DrawFn) -> FloatArray:
    """Return the observations of all slots: anything in most columns, contacts with some slot."""
    seen = np.stack([draw(rows(OBSERVATION_WIDTH, -10.0, 10.0)) for _ in range(SLOTS)])
    for row in seen:
        row[contract.ENCOUNTER] = draw(st.sampled_from([0.0, 1.0]))
        row[contract.ENCOUNTER_ROBOT] = draw(st.integers(0, SLOTS - 1))
        row[contract.ENCOUNTER_NONCE] = draw(st.integers(0, 2**48 - 1))
    return seen


@given(seen=st.lists(observed(), min_size=1, max_size=3), gone=st.integers(0, SLOTS))
def test_every_robot_reads_what_its_body_senses(seen: list[FloatArray], gone: int) -> None:
    """Row, tick, and the contact with the id of the robot that is met, unless it has left; for several ticks."""
    node, memory = filled_node(), SharedPages(SLOTS)
    pages = [memory.begin(slot) for slot in range(SLOTS)]
    if gone < SLOTS:
        node.leave(IDS[gone])
    for observations in seen:
        node.tick += 1
        node.arena.world.observations[-1] = observations
        node.write_observations(memory.arrays)
        for robot, slot in node.robots.items():
            row, contact = node.sense(robot)
            read = pages[slot].read_observation()
            assert read is not None
            assert read.tick == node.tick
            assert np.array_equal(read.row, row, equal_nan=True)
            assert read.contact == contact
    memory.close()


def test_all_at_once_are_written_as_one_alone(here: Machine) -> None:
    """The observation that a robot gets when its link opens is like all that follow."""
    node = here.node
    row = node.arena.world.observations[-1, 0]
    row[contract.ENCOUNTER], row[contract.ENCOUNTER_ROBOT] = 1.0, 2.0
    row[contract.ENCOUNTER_NONCE] = 2.0**48 - 1
    here.pages[0].write_observation(node.tick, *node.sense(IDS[0]))
    alone = here.pages[0].read_observation()
    here.pages[0].clear()
    node.write_observations(here.memory.arrays)
    together = here.pages[0].read_observation()
    assert alone is not None
    assert together is not None
    assert (alone.tick, alone.contact) == (together.tick, together.contact)
    assert np.array_equal(alone.row, together.row)
    assert together.contact is not None
    assert (together.contact.robot, together.contact.nonce) == (IDS[2], 2**48 - 1)


def test_a_robot_that_reads_late_reads_the_latest(here: Machine) -> None:
    """An observation that was not read is replaced by the next."""
    node, (page, *_) = here.node, here.pages
    for _ in range(3):
        node.write_observations(here.memory.arrays)
        node.step()
    read = page.read_observation()
    assert read is not None
    assert read.tick == node.tick - 1


def test_a_slot_without_a_page_is_left_alone(here: Machine) -> None:
    """No memory but that of the slots with pages is written, and its robot's actions go another way."""
    node, arrays = here.node, here.memory.arrays
    arrays.words[len(here.pages) :] = 77
    node.write_observations(arrays)
    node.take_actions(arrays)
    assert (arrays.words[len(here.pages) :] == 77).all()
    before = node.save()
    node.write_observations(no_pages())
    node.take_actions(no_pages())
    assert np.array_equal(node.save()["answered"], before["answered"])


# Actions --------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Acts:
    """A robot answers the observation of a tick: so many before the present one, or after it."""

    slot: int
    age: int
    row: FloatArray


@st.composite
def acts(draw: st.DrawFn) -> Acts:
    """Return an action whose time to live is often over at the very moment, or just before or after."""
    row = draw(rows(ACTION_WIDTH, -2.0, 12.0))
    periods = draw(st.none() | st.integers(0, 6))
    if periods is not None:
        row[contract.TTL] = periods * PERIOD_S
    age = draw(st.sampled_from([0, 0, 0, 1, 1, 2, 5, -1]))
    return Acts(draw(st.integers(0, WITHOUT_PAGE - 1)), age, row)


@given(
    history=st.lists(acts() | st.just("tick") | st.just("hold"), max_size=25),
    lockstep=st.booleans(),
)
def test_actions_on_pages_are_applied_as_those_of_the_network(
    history: list[Acts | str], lockstep: bool
) -> None:
    """Clipped, refused, counted and answered alike, in lockstep and in real time; so are the worlds that follow."""
    network, local = (filled_node(lockstep=lockstep) for _ in range(2))
    memory = SharedPages(SLOTS)
    pages = [memory.begin(slot) for slot in range(WITHOUT_PAGE)]
    last = dict.fromkeys(range(WITHOUT_PAGE), -1)
    for event in history:
        if isinstance(event, Acts):
            tick = network.tick - event.age
            # An action that is written again is the same one here; over the network it is counted as stale.
            if tick >= 0 and tick != last[event.slot]:
                network.apply_row(IDS[event.slot], tick, event.row)
                pages[event.slot].write_action(tick, event.row)
                local.take_actions(memory.arrays)
                last[event.slot] = tick
        else:
            for node in (network, local):
                node.is_held = event == "hold"
                node.step()
        assert_same(network, local)
    memory.close()


def assert_same(one: ArenaNode, other: ArenaNode) -> None:
    """Compare two arenas: what they wait for, what they have refused, and their whole state."""
    assert one.waiting_for == other.waiting_for
    assert one.counts == other.counts
    saved, others = one.save(), other.save()
    for name in ("actions", "fresh", "answered"):
        assert np.array_equal(saved[name], others[name]), name
    assert np.array_equal(one.arena.world.observations, other.arena.world.observations)


@pytest.mark.parametrize("age", range(5))
def test_in_real_time_an_action_is_late_at_the_same_moment(here: Machine, age: int) -> None:
    """When it is older than its own time to live, to the very period; without one it is never late."""
    for periods in range(6):
        network, local = (filled_node(lockstep=False) for _ in range(2))
        page = here.memory.begin(0)
        row = np.zeros(ACTION_WIDTH)
        row[contract.TTL] = PERIOD_S * periods
        for node in (network, local):
            for _ in range(5):
                node.step()
        network.apply_row(IDS[0], network.tick - age, row)
        page.write_action(local.tick - age, row)
        local.take_actions(here.memory.arrays)
        assert_same(network, local)


def test_every_action_is_taken_once(here: Machine) -> None:
    """It does not answer the next observation, nor is it counted as late then."""
    node, arrays = here.node, here.memory.arrays
    for page in here.pages:
        page.write_action(node.tick, np.zeros(ACTION_WIDTH))
    node.take_actions(arrays)
    assert node.waiting_for == [IDS[WITHOUT_PAGE]]
    node.step()
    node.take_actions(arrays)
    assert node.waiting_for == IDS[:SLOTS]
    assert not node.counts


def test_an_observation_that_was_answered_over_the_network_is_not_answered_again(
    here: Machine,
) -> None:
    """As when the link opens in between."""
    node, page = here.node, here.pages[0]
    assert node.apply_row(IDS[0], node.tick, np.zeros(ACTION_WIDTH))
    page.write_action(node.tick, np.ones(ACTION_WIDTH))
    node.take_actions(here.memory.arrays)
    assert node.counts == {"stale": 1}
    assert not node.save()["actions"][0].any()


def test_an_action_that_is_being_written_is_taken_when_it_is_whole(here: Machine) -> None:
    """Also if it is one that is written again."""
    node, arrays, page = here.node, here.memory.arrays, here.pages[0]
    page.write_action(node.tick, np.zeros(ACTION_WIDTH))
    at = ACTION_AT + (node.tick & 1) * ACTION_WORDS
    page.arrays.words[at] = -1
    node.take_actions(arrays)
    assert IDS[0] in node.waiting_for
    page.arrays.words[at] = node.tick
    node.take_actions(arrays)
    assert IDS[0] not in node.waiting_for


def test_a_page_that_is_given_to_another_robot_says_nothing_of_the_former() -> None:
    """Neither its last action nor its last observation."""
    node, memory = new_node(), SharedPages(1)
    join(node, 0)
    node.step()
    for _ in range(3 * len(memory.arrays.words)):
        page = memory.begin(0)
        assert page.read_observation() is None
        node.take_actions(memory.arrays)
        assert node.waiting_for == [IDS[0]]
        page.write_observation(node.tick, *node.sense(IDS[0]))
        page.write_action(node.tick, np.zeros(ACTION_WIDTH))
    assert node.arena_run == ARENA_RUN
    memory.close()
