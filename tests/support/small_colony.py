"""A small in-process colony whose generations take a moment, for tests."""

from typing import TypeVar

from crcolony.config import Config, load
from crcolony.evolution.history import Event, HistoryHash
from crcolony.in_process.colony import InProcessColony

SMALL = (
    "life.agents=4",
    "life.slices=2",
    "life.slice_steps=150",
    "life.initial_energy=1.0",
    "arena.area_per_robot_m2=0.4",
)
"""Many robots in little space, with much energy, so that there are matings in every generation."""


def small(*settings: str) -> Config:
    return load(None, [*SMALL, "generations=3", *settings])


Kind = TypeVar("Kind", bound=Event)


class Recorder:
    """Records every event, and their hash."""

    def __init__(self) -> None:
        self.events: list[Event] = []
        self.hash = HistoryHash()

    def __call__(self, event: Event) -> None:
        self.events.append(event)
        self.hash.add(event)

    def all(self, kind: type[Kind]) -> list[Kind]:
        return [event for event in self.events if isinstance(event, kind)]


def new_colony(*settings: str) -> tuple[InProcessColony, Recorder]:
    recorder = Recorder()
    return InProcessColony(small(*settings), recorder), recorder


def live(colony: InProcessColony, generations: int = 3, chunk_ticks: int = 10_000) -> None:
    while colony.generation < generations:
        colony.run(chunk_ticks)


def history(*settings: str, chunk_ticks: int = 10_000) -> str:
    colony, recorder = new_colony(*settings)
    colony.start()
    live(colony, chunk_ticks=chunk_ticks)
    return str(recorder.hash)
