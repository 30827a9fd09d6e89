"""The schemes that make the next agents of all robots at once: for comparison, and in one process only."""

from typing import Any, Protocol

from crcolony.config import Config
from crcolony.evolution.genotype import Schema
from crcolony.evolution.gpbt_pl import GpbtPl
from crcolony.evolution.lineage import Birth
from crcolony.evolution.ompac import Ompac
from crcolony.in_process.central_selection import CentralSelection
from crcolony.in_process.lamarckian_selection import Competition, LamarckianSelection
from crcolony.robot.factory import make_variation
from crcolony.robot.robot import Robot
from crcolony.robot.state import Robots


class CentralScheme(Protocol):
    """A scheme that sees all robots."""

    def turn_over(self, robots: list[Robot], batch: Robots) -> list[list[Birth]]:
        """Give every robot its next agents; return the births of each robot."""
        ...

    def save(self) -> Any:
        """Return a copy of all that it remembers."""
        ...

    def restore(self, saved: Any) -> None:
        """Restore what was saved; raises KeyError, TypeError or ValueError if it does not fit."""
        ...


def make_central_scheme(config: Config, schema: Schema) -> CentralScheme | None:
    """Return the central scheme that is set; None: robots reproduce by themselves."""
    variation = make_variation(config.heredity)
    instances = config.robots * config.life.agents
    if config.selection == "central":
        return CentralSelection(schema, variation, config.seed)
    competition: Competition
    if config.selection == "ompac":
        competition = Ompac(lambda genes, rng: variation.mutant(genes, schema, rng), instances)
    elif config.selection == "gpbt_pl":
        competition = GpbtPl(schema, instances)
    else:
        return None
    return LamarckianSelection(competition, config.seed)
