"""The founders of a run or of a robot, in its folder: what it began with, though the earlier run may be gone by now."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from crcolony.durable_files import replace_file
from crcolony.evolution.founders import Founders
from crcolony.evolution.population import NewAgent
from crcolony.storage.checkpoint import CheckpointError, read_checkpoint, write_checkpoint
from crcolony.storage.files import FolderError
from crcolony.storage.folder_record import Origin

FOUNDERS_FILE = "founders.npz"
"""Its name in the folder."""


@dataclass(frozen=True)
class Beginning:
    """What robots begin with in place of random genotypes."""

    founders: Founders
    origin: Origin

    def share_of(self, number: int) -> "Beginning":
        """Return what the robot with this number needs of it."""
        return Beginning(self.founders.share_of(number), self.origin)


def write_founders(folder: Path, founders: Founders) -> None:
    """Write the founders of a folder; raises FolderError."""
    content = {
        "schema": founders.schema,
        "population": founders.population,
        "robots": [
            {
                "names": [agent.mother for agent in subpopulation],
                "genes": np.stack([agent.genes for agent in subpopulation]),
            }
            for subpopulation in founders.subpopulations
        ],
    }
    path = folder / FOUNDERS_FILE
    try:
        replace_file(path, lambda file: write_checkpoint(file, content))
    except OSError as error:
        raise FolderError(f"{path}: cannot be written: {error.strerror}") from None


def read_founders(folder: Path) -> Founders:
    """Read the founders of a folder; raises FolderError if they are missing or damaged."""
    path = folder / FOUNDERS_FILE
    try:
        saved = read_checkpoint(path)
        return Founders(
            str(saved["schema"]),
            str(saved["population"]),
            tuple(_agents_of(robot) for robot in saved["robots"]),
        )
    except FileNotFoundError:
        raise FolderError(f"{path}: missing") from None
    except (CheckpointError, KeyError, TypeError, ValueError) as error:
        raise FolderError(f"{path}: corrupt: {error}") from None


def _agents_of(saved: dict[str, Any]) -> tuple[NewAgent, ...]:
    return tuple(
        NewAgent(genes, str(name), None)
        for genes, name in zip(saved["genes"], saved["names"], strict=True)
    )
