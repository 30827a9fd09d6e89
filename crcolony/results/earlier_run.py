"""An earlier run whose robots others begin with (`--from`), read from its folder, which may be in use meanwhile.

The folder is that of an `evolve`, a `launch` or a `host`, or of a single robot. Robots' own files are newer than the
merged history, and are read if they are there.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from crcolony.config import CONFIG_FILE, Config, load
from crcolony.errors import CrcolonyError
from crcolony.evolution.founders import FoundersError, make_founders, population_digest
from crcolony.evolution.history import Born
from crcolony.results.history_database import HISTORY_DATABASE, read_births
from crcolony.results.merged_history import merge_robot_files
from crcolony.robot.genes import agent_schema
from crcolony.storage.files import (
    ROBOT_FILE,
    FolderError,
    existing_robot_file,
    robot_files_of_run,
)
from crcolony.storage.folder_record import Origin, maker_of
from crcolony.storage.founders_file import Beginning


class EarlierRunError(CrcolonyError):
    """Robots cannot begin with those of a folder: the message names it, the reason, and what would work."""


@dataclass(frozen=True)
class EarlierRun:
    """The subpopulations of an earlier run, each as the births of its agents."""

    folder: Path
    subpopulations: tuple[tuple[Born, ...], ...]

    @property
    def config_file(self) -> Path | None:
        """The path of its config; None if it has none: the folder of a single robot."""
        path = self.folder / CONFIG_FILE
        return path if path.is_file() else None

    @property
    def origin(self) -> Origin:
        """What is recorded of it in the folder of a run that begins with its robots."""
        newest = max(births[0].generation for births in self.subpopulations)
        return Origin(str(self.folder.resolve()), newest, population_digest(self.subpopulations))

    def beginning(self, config: Config) -> Beginning:
        """Return what robots with this config begin with; raises EarlierRunError if their genes are others."""
        schema = agent_schema(config.learning, config.heredity)
        was = schema
        if self.config_file is not None:
            earlier = load(self.config_file)
            was = agent_schema(earlier.learning, earlier.heredity)
        try:
            founders = make_founders(self.subpopulations, was, schema)
        except FoundersError as error:
            raise EarlierRunError(f"{self.folder}: its robots have other genes: {error}") from None
        return Beginning(founders, self.origin)

    def describe(self, robots: int, agents: int) -> str:
        """Return a line that says what so many robots with so many agents each begin with."""
        were, sizes = len(self.subpopulations), {len(births) for births in self.subpopulations}
        generations = sorted({births[0].generation for births in self.subpopulations})
        span = "-".join(map(str, dict.fromkeys((generations[0], generations[-1]))))
        line = f"robots begin with generation {span} of {self.folder}"
        if robots > were:
            line += f", the subpopulations of {were} robots dealt out again to {robots}"
        elif robots < were:
            line += f", the subpopulations of the first {robots} of {were} robots"
        if agents > min(sizes):
            line += f", {min(sizes)} agents of each dealt out again to {agents}"
        elif agents < max(sizes):
            line += f", the first {agents} of {max(sizes)} agents of each"
        return line


def read_earlier_run(folder: Path, generation: int | None = None) -> EarlierRun:
    """Read the subpopulations of a generation of a run; None: the newest one of each robot.

    Raises EarlierRunError, FolderError, or StorageError for the file of a robot.
    """
    _check_is_run(folder)
    by_robot: dict[int, dict[int, list[Born]]] = {}
    for born in _births_of(folder):
        by_robot.setdefault(born.robot, {}).setdefault(born.generation, []).append(born)
    if not by_robot:
        raise EarlierRunError(f"{folder}: none of its robots has been born yet; wait a moment")
    last = min(max(generations) for generations in by_robot.values())
    if generation is not None and not 0 <= generation <= last:
        raise EarlierRunError(
            f"--generation {generation}: the generations of {folder} are 0 to {last}"
        )
    chosen = (
        generations.get(max(generations) if generation is None else generation)
        for _, generations in sorted(by_robot.items())
    )
    return EarlierRun(folder, tuple(tuple(births) for births in chosen if births))


def _check_is_run(folder: Path) -> None:
    if not folder.exists():
        raise EarlierRunError(f"{folder}: there is no such folder; give the folder of a run")
    if not folder.is_dir():
        raise EarlierRunError(f"{folder}: a file; give the folder of the run: {folder.parent}")
    maker = maker_of(folder)
    if maker == "evolve --seeds":
        runs = sorted(folder.glob("*/seed-*"))
        named = f"give one of them, as in --from {runs[0]}" if runs else "none has begun"
        raise EarlierRunError(f"{folder}: holds the {len(runs)} runs of a sweep; {named}")
    if maker == "demo":
        raise EarlierRunError(
            f"{folder}: holds two runs of a demo; give {folder / 'evolved'} or {folder / 'live'}"
        )
    if maker not in ("evolve", "launch", "host", "robot"):
        made_by = f"made by crcolony {maker}" if maker else "not the folder of a run"
        raise EarlierRunError(f"{folder}: {made_by}; give that of an evolve, a launch or a host")


def _births_of(folder: Path) -> Sequence[Born]:
    own = existing_robot_file(folder / ROBOT_FILE)
    files = [own] if own.is_file() else robot_files_of_run(folder)
    if files:
        return [event for event in merge_robot_files(files).events if isinstance(event, Born)]
    history = folder / HISTORY_DATABASE
    if maker_of(folder) != "evolve" and not history.exists():
        return []
    if not history.exists():
        raise FolderError(f"{history}: missing")
    return read_births(history)
