"""The control step on a page of memory: a robot reads its observation there, and writes its action there.

The page may be one that it shares with its body's process (`body/shared_pages.py`). Then the step also sees whether
anything but an action follows from an observation: if not, nobody else has to be asked.
"""

from crcolony.body.contract import ACTION_WIDTH, OBSERVATION_WIDTH
from crcolony.body.shared_pages import (
    ACTION_AT,
    ACTION_WORDS,
    LATEST_ACTION,
    LATEST_OBSERVATION,
    NOTHING,
    OBSERVATION_AT,
    OBSERVATION_WORDS,
    ROW_AFTER,
    Page,
)
from crcolony.compiled import compiled
from crcolony.robot.state import Robots, StepParameters
from crcolony.robot.step import step_robot

NOT_QUIET = -1
"""No step was made: the observation is not there, or has a contact, or is beyond the limits"""


@compiled
def step_page(robots: Robots, parameters: StepParameters, page: Page, i: int, tick: int) -> int:
    """Advance robot i by the observation of a tick, if it is the latest one and quiet; return the bits of the events.

    The action is written, and is the latest one if there are no events: otherwise it has to wait for what follows from
    them. With `NOTHING` for a tick the robot steps by the observation in the place of even ticks, whatever it is.
    Returns NOT_QUIET if it makes no step.
    """
    words, numbers = page.words, page.numbers
    seen = OBSERVATION_AT
    acts = ACTION_AT
    if tick != NOTHING:
        seen += (tick & 1) * OBSERVATION_WORDS
        acts += (tick & 1) * ACTION_WORDS
        if words[LATEST_OBSERVATION] != tick or words[seen] != tick or words[seen + 1] != NOTHING:
            return NOT_QUIET
        for column in range(OBSERVATION_WIDTH):
            value = numbers[seen + ROW_AFTER + column]
            if not page.limits[0, column] <= value <= page.limits[1, column]:
                return NOT_QUIET
    observation = numbers[seen + ROW_AFTER : seen + ROW_AFTER + OBSERVATION_WIDTH]
    action = numbers[acts + 1 : acts + 1 + ACTION_WIDTH]
    step_robot(robots, parameters, i, observation, action)
    if tick != NOTHING and robots.events[i] == 0:
        words[acts] = tick
        words[LATEST_ACTION] = tick
    return int(robots.events[i])
