"""The learning modules of a virtual agent (Paper III, thesis 5.3): one row of a table each.

A module learns to reach its target: the blob it watches, and the observation that says it
succeeded. To add a module, add a row; genes, selector and learning follow.
"""

from dataclasses import dataclass

from crcolony.body import contract


@dataclass(frozen=True)
class LearningModule:
    """One basic behaviour, which every agent learns from nothing."""

    name: str
    target: int
    """The blob it watches: the observation's `…_visible` column."""
    success: int
    """The observation column that is above 0 when it has succeeded; its reward is then 1."""
    beacon: bool
    """Whether it switches the IR beacon on: ready to mate."""
    is_refractory: bool
    """Whether a success is followed by the refractory time."""
    lamp: tuple[float, float, float]
    """The colour it shows on the robot's face: red, green, blue."""


FORAGING = LearningModule("foraging", contract.PACK, contract.CHARGE, False, False, (0.0, 1.0, 0.0))
MATING = LearningModule("mating", contract.FACE, contract.ENCOUNTER, True, True, (1.0, 0.0, 0.0))

MODULES = (FORAGING, MATING)
"""The first is in control unless another module's selector output is above 0."""
