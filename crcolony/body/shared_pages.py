"""Where observations and actions lie in the memory that an arena shares with the robots on its machine.

Each robot has a page of its own, in which it and its body each write a half. A row lies in one of two places, by
whether its tick is even or odd, so that the reader of the newest one is not in the way of the writer of the next. The
tick of a row is written after the row; the reader reads it before and after. These functions are the arena's side, for
all robots at once.
"""

import math
import mmap
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from crcolony.body.contract import (
    ACTION_WIDTH,
    ENCOUNTER,
    ENCOUNTER_NONCE,
    ENCOUNTER_ROBOT,
    OBSERVATION,
    OBSERVATION_WIDTH,
    TTL,
    limits,
)
from crcolony.compiled import FloatArray, IntArray, compiled

LAYOUT = 1
"""Version of what lies where: a robot and a body with different ones share no memory."""
PAGE_BYTES = mmap.ALLOCATIONGRANULARITY
"""The least that a process can have of another's memory: 4 KiB on most machines, 16 or 64 on some ARM boards"""
PAGE_WORDS = PAGE_BYTES // 8
"""A page is an array of words of 64 bits: integers, or numbers of the rows"""

NOTHING = -1
"""In place of a tick or a nonce"""
NO_PAGE = -1
LATEST_OBSERVATION, LATEST_ACTION = 0, 1
"""The words of a page with the ticks of the newest rows"""
OBSERVATION_AT = 8
"""The word with the tick of an even observation; behind it the contact's nonce, the id of the robot that was met (two
words), and the row"""
ROW_AFTER = 4
OBSERVATION_WORDS = ROW_AFTER + OBSERVATION_WIDTH
ACTION_AT = OBSERVATION_AT + 2 * OBSERVATION_WORDS
"""The word with the tick of an even action; behind it the row"""
ACTION_WORDS = 1 + ACTION_WIDTH

_SENSED: FloatArray = np.clip(limits(OBSERVATION), -np.finfo(float).max, np.finfo(float).max)
"""No number beyond is finite"""

ACCEPTED, STALE, MALFORMED = 0, 1, 2
"""Columns of `taken`: how many actions were applied, late, or had a number that is not finite"""


class Page(NamedTuple):
    """The page of one robot."""

    words: IntArray
    """(PAGE_WORDS,)"""
    numbers: FloatArray
    """The same memory, as numbers"""
    limits: FloatArray
    """The least and the most that a body can sense, all finite, shape (2, OBSERVATION_WIDTH)"""


def page_of(words: IntArray) -> Page:
    """Return the page in these words (PAGE_WORDS,)."""
    return Page(words, words.view(np.float64), _SENSED)


def new_page() -> Page:
    """Return a page without rows that is not shared."""
    words = np.zeros(PAGE_WORDS, dtype=np.int64)
    words[[LATEST_OBSERVATION, LATEST_ACTION]] = NOTHING
    return page_of(words)


def action_on(page: Page, tick: int) -> FloatArray:
    """Return a copy of the action (ACTION_WIDTH,) for a tick."""
    at = ACTION_AT + (tick & 1) * ACTION_WORDS + 1
    return page.numbers[at : at + ACTION_WIDTH].copy()


class Pages(NamedTuple):
    """The pages of an arena."""

    words: IntArray
    """All pages, shape (pages, PAGE_WORDS)"""
    numbers: FloatArray
    """The same memory, as numbers"""
    page_of: IntArray
    """The page of each slot, shape (slots,); -1: it has none"""
    taken: IntArray
    """The tick of the last action that was taken from each slot, shape (slots,)"""


def no_pages() -> Pages:
    """Return the pages of an arena that shares no memory."""
    words = np.zeros((0, PAGE_WORDS), dtype=np.int64)
    return Pages(words, words.view(np.float64), np.zeros(0, np.int64), np.zeros(0, np.int64))


@compiled
def write_observations(
    pages: Pages,
    tick: int,
    rows: FloatArray,
    ids: IntArray,
    colonies: IntArray,
) -> None:
    """Write the rows (slots, OBSERVATION_WIDTH) of a tick into the pages of the slots that have one.

    `ids` (slots, 2) are the ids of the robots in the slots, as two words each, and `colonies` (slots,) their colonies,
    -1 for a slot without a robot.
    """
    words, numbers = pages.words, pages.numbers
    for slot in range(pages.page_of.shape[0]):
        page = pages.page_of[slot]
        if page == NO_PAGE:
            continue
        at = OBSERVATION_AT + (tick & 1) * OBSERVATION_WORDS
        words[page, at] = NOTHING
        for column in range(OBSERVATION_WIDTH):
            numbers[page, at + ROW_AFTER + column] = rows[slot, column]
        words[page, at + 1] = NOTHING
        if rows[slot, ENCOUNTER] > 0.0:
            partner = int(rows[slot, ENCOUNTER_ROBOT])
            if colonies[partner] >= 0:
                words[page, at + 1] = int(rows[slot, ENCOUNTER_NONCE])
                words[page, at + 2] = ids[partner, 0]
                words[page, at + 3] = ids[partner, 1]
        words[page, at] = tick
        words[page, LATEST_OBSERVATION] = tick


@compiled
def take_actions(
    pages: Pages,
    tick: int,
    lockstep: bool,
    period_s: float,
    action_limits: FloatArray,
    answered: IntArray,
    actions: FloatArray,
    fresh: NDArray[np.bool_],
    counts: IntArray,
) -> None:
    """Take the actions that the robots have written since the last call, as `BodySlots.apply_row` does.

    `action_limits` (2, ACTION_WIDTH) are the lowest and the highest action; `counts` (3,) counts what became of them.
    """
    words, numbers = pages.words, pages.numbers
    for slot in range(pages.page_of.shape[0]):
        page = pages.page_of[slot]
        if page == NO_PAGE:
            continue
        latest = words[page, LATEST_ACTION]
        at = ACTION_AT + (latest & 1) * ACTION_WORDS
        if latest == pages.taken[slot] or words[page, at] != latest:
            continue
        age = tick - latest
        is_finite = True
        for column in range(ACTION_WIDTH):
            is_finite &= math.isfinite(numbers[page, at + 1 + column])
        ttl_s = min(max(numbers[page, at + 1 + TTL], action_limits[0, TTL]), action_limits[1, TTL])
        is_late = age > 0 if lockstep else 0.0 < ttl_s < age * period_s
        if not is_finite:
            counts[MALFORMED] += 1
        elif is_late or age < 0 or latest <= answered[slot]:
            counts[STALE] += 1
        else:
            for column in range(ACTION_WIDTH):
                # In this order a number that has become NaN since it was checked is the lowest one.
                value = max(action_limits[0, column], numbers[page, at + 1 + column])
                actions[slot, column] = min(action_limits[1, column], value)
            if words[page, at] != latest:  # it is being written again, and taken when that is done
                continue
            answered[slot] = latest
            fresh[slot] = True
            counts[ACCEPTED] += 1
        pages.taken[slot] = latest
