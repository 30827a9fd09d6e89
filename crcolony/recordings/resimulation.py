"""A run that is over, as it would have been heard on the network: lived again, or told again from its history.

An embedded or lockstep colony follows from its config alone: it is lived again, from the first tick on, and in some
windows shown in full. Of any other only what its history holds is told.
"""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

from crcolony.config import Config, ConfigError
from crcolony.evolution.history import Born, Event, HistoryHash
from crcolony.in_process.colony import InProcessColony
from crcolony.nodes.reported_settings import settings_as_json, settings_of_robot
from crcolony.protocol.telemetry_messages import MAX_ARENA_SETTINGS
from crcolony.recordings.past_run import PastRun, PastRunError, read_history
from crcolony.recordings.synthetic_telemetry import RobotSnapshot, SyntheticTelemetry
from crcolony.telemetry.colony_monitor import TelemetrySample

_STATE_S, _COARSE_STATE_S = 0.5, 60.0
"""How often robots tell how they are, of the colony's time, in windows and beside them"""
_COARSE_STATES = 50_000
"""Beside windows there are about so many states at most, and those at the ends of generations"""


class HistoryDiffersError(PastRunError):
    """A run that was lived again had another history than its folder says."""


@dataclass(frozen=True)
class Windows:
    """Which parts of a run are shown in full, with all scenes: the beginnings of some generations."""

    generations: frozenset[int] | None = None
    """None: the first and the last that ended"""
    length_s: float = 120.0
    """Of the colony's time"""


def resimulate(run: PastRun, windows: Windows | None = None) -> Iterator[TelemetrySample]:
    """Live a run again, as far as its folder says, and yield what would have been heard of it.

    Raises PastRunError if nobody can live it again, and in the end HistoryDiffersError if it was not the same.
    """
    if not run.is_repeatable:
        raise PastRunError(f"{run.folder}: a run in real time, which cannot be lived again")
    return _Resimulation(run, windows or Windows()).live()


class _Resimulation:
    """One time that a run is lived again."""

    def __init__(self, run: PastRun, windows: Windows) -> None:
        self._run = run
        self._windows = _chosen(windows, run)
        self._events: list[Event] = []
        self._hash = HistoryHash()
        self._is_whole = False
        """Whether all has happened that had when the run ended"""
        self._synthetic = _narrator_of(run)
        period_s = run.config.arena.control_period_s
        self._window_ticks = math.ceil(windows.length_s / period_s)
        self._state_ticks = max(1, round(_STATE_S / period_s))
        self._coarse_ticks = _coarse_ticks(run.config, run.generations)
        try:
            self._colony = InProcessColony(run.config, self._events.append)
        except ValueError as error:
            raise ConfigError(f"{run.folder}: {error}") from None

    def live(self) -> Iterator[TelemetrySample]:
        """Yield what is heard, from the beginning to the end; raises HistoryDiffersError there."""
        colony, run = self._colony, self._run
        yield from _begin(self._synthetic, run.config)
        colony.start()
        yield from self._tell()
        yield from self._states()
        generation, born_tick = 0, 0
        while not self._is_over():
            if colony.generation > generation:
                generation, born_tick = colony.generation, colony.tick
            age = colony.tick - born_tick
            if generation in self._windows and age < self._window_ticks:
                colony.run(1)
                yield self._synthetic.scene(colony.arena.world, colony.tick)
                is_due = colony.tick % self._state_ticks == 0
            else:
                colony.run(self._coarse_ticks - colony.tick % self._coarse_ticks)
                is_due = True
            yield from self._tell()
            if not self._events and (is_due or self._is_over() or colony.generation > generation):
                yield from self._states()
        if not self._is_whole:
            raise HistoryDiffersError(
                f"{run.folder}: lived again it has another history than run.json says:"
                " it was made by another version of crcolony, or went on in real time"
            )

    def _is_over(self) -> bool:
        """Whether the run ended here, or must have ended before."""
        last = self._run.config.generations or math.inf
        return self._is_whole or self._colony.generation > min(self._run.generations, last - 1)

    def _tell(self) -> Iterator[TelemetrySample]:
        """Tell what has happened, up to the end of the run; events that are left then were not part of it."""
        while self._events and not self._is_whole:
            event = self._events.pop(0)
            self._hash.add(event)
            self._is_whole = str(self._hash) == self._run.history_hash
            yield from self._synthetic.event_samples(event)

    def _states(self) -> Iterator[TelemetrySample]:
        colony, batch = self._colony, self._colony.batch
        for robot in colony.robots:
            row, subpopulation = robot.row, robot.subpopulation
            condition = RobotSnapshot(
                agent=subpopulation.ids[robot.agent],
                energy=robot.energy,
                module=int(batch.module[row]),
                captures=int(batch.captures[row].sum()),
                pool=len(subpopulation.pool),
            )
            yield self._synthetic.state(row, colony.tick, condition)


def initial_samples(run: PastRun) -> Iterator[TelemetrySample]:
    """Yield what is heard of any run first: who is there, and what they are like."""
    return _begin(_narrator_of(run), run.config)


def from_history(run: PastRun) -> Iterator[TelemetrySample]:
    """Yield what is known of a run from its history alone: events, and a state of each robot at its turnovers.

    Where robots were, who was in control and how hungry is not in it. Raises PastRunError.
    """
    synthetic = _narrator_of(run)
    yield from _begin(synthetic, run.config)
    newborn = RobotSnapshot("", run.config.life.initial_energy, -1, captures=0, pool=0)
    for tick, events in itertools.groupby(read_history(run.history), lambda event: event.tick):
        turned_over: dict[int, None] = {}
        for event in events:
            yield from synthetic.event_samples(event)
            if isinstance(event, Born) and event.robot < len(run.robots):
                turned_over[event.robot] = None
        for number in turned_over:
            yield synthetic.state(number, tick, newborn)


def _narrator_of(run: PastRun) -> SyntheticTelemetry:
    period_s = run.config.arena.control_period_s
    return SyntheticTelemetry(run.colony, run.robots, run.start_unix_ms, period_s)


def _begin(synthetic: SyntheticTelemetry, config: Config) -> Iterator[TelemetrySample]:
    nature = settings_as_json({"arena": config.arena, "body": config.body}, MAX_ARENA_SETTINGS)
    return synthetic.start(settings_of_robot(config, config.body), nature)


def _chosen(windows: Windows, run: PastRun) -> frozenset[int]:
    if windows.generations is not None:
        return windows.generations
    return frozenset((0, max(0, run.generations - 1)))


def _coarse_ticks(config: Config, generations: int) -> int:
    """Return how many ticks are between two coarse states of a robot."""
    ticks = config.life.agents * config.life.slices * config.life.slice_steps * generations
    seldom = math.ceil(ticks * config.robots / _COARSE_STATES)
    return max(1, round(_COARSE_STATE_S / config.arena.control_period_s), seldom)
