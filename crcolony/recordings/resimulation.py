"""The telemetry of a finished run that nobody recorded: re-simulated, or synthesised from its history.

An in-process or lockstep colony follows from its config alone: it is simulated again from the first tick on, with
scenes in some windows. Of any other run there is only what its history holds.
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
from crcolony.storage.founders_file import read_founders
from crcolony.telemetry.samples import TelemetrySample

_STATE_PERIOD_S = 0.5
"""Between two states of a robot within a window, in the colony's time."""
_COARSE_STATE_PERIOD_S = 60.0
"""Between two states of a robot outside of windows, at least."""
_MAX_COARSE_STATES = 50_000
"""States outside of windows, about, besides those at the ends of generations."""


class HistoryDiffersError(PastRunError):
    """A re-simulated run has another history than its folder says."""


@dataclass(frozen=True)
class Windows:
    """The parts of a run that are re-simulated with scenes and frequent states: the starts of some generations."""

    generations: frozenset[int] | None = None
    """None: the first and the last that ended"""
    length_s: float = 120.0
    """In the colony's time"""


def resimulate(run: PastRun, windows: Windows | None = None) -> Iterator[TelemetrySample]:
    """Simulate a run again until its end, and yield its telemetry.

    Raises PastRunError if it cannot be re-simulated, and HistoryDiffersError at the end if its history differs.
    """
    if not run.is_repeatable:
        raise PastRunError(f"{run.folder}: a run in real time cannot be re-simulated")
    return _Resimulation(run, windows or Windows()).run()


class _Resimulation:
    """One re-simulation of a run."""

    def __init__(self, run: PastRun, windows: Windows) -> None:
        self._run = run
        self._windows = window_generations(windows, run)
        self._events: list[Event] = []
        """Events of the colony without samples yet"""
        self._hash = HistoryHash()
        self._is_complete = False
        """Whether all events of the run have happened"""
        self._synthetic = _synthetic_telemetry(run)
        period_s = run.config.arena.control_period_s
        self._window_ticks = math.ceil(windows.length_s / period_s)
        self._state_ticks = max(1, round(_STATE_PERIOD_S / period_s))
        self._coarse_ticks = _coarse_state_ticks(run.config, run.generations)
        try:
            founders = read_founders(run.folder) if run.population else None
            self._colony = InProcessColony(run.config, self._events.append, founders)
        except ValueError as error:
            raise ConfigError(f"{run.folder}: {error}") from None

    def run(self) -> Iterator[TelemetrySample]:
        """Yield the telemetry from the first tick to the last; raises HistoryDiffersError there."""
        colony, run = self._colony, self._run
        yield from _initial_samples(self._synthetic, run.config)
        colony.start()
        yield from self._event_samples()
        yield from self._state_samples()
        generation, start_tick = 0, 0
        while not self._is_over():
            if colony.generation > generation:
                generation, start_tick = colony.generation, colony.tick
            age_ticks = colony.tick - start_tick
            if generation in self._windows and age_ticks < self._window_ticks:
                colony.run(1)
                yield self._synthetic.scene_sample(colony.arena.world, colony.tick)
                is_due = colony.tick % self._state_ticks == 0
            else:
                colony.run(self._coarse_ticks - colony.tick % self._coarse_ticks)
                is_due = True
            yield from self._event_samples()
            if not self._events and (is_due or self._is_over() or colony.generation > generation):
                yield from self._state_samples()
        if not self._is_complete:
            raise HistoryDiffersError(
                f"{run.folder}: re-simulated, it has another history than run.json says:"
                " it was run by another version of crcolony, or continued in real time"
            )

    def _is_over(self) -> bool:
        """Return whether the run ended here, or must have ended before."""
        last = self._run.config.generations or math.inf
        return self._is_complete or self._colony.generation > min(self._run.generations, last - 1)

    def _event_samples(self) -> Iterator[TelemetrySample]:
        """Yield the events that have happened; those after the end of the run stay, which were not part of it."""
        while self._events and not self._is_complete:
            event = self._events.pop(0)
            self._hash.add(event)
            self._is_complete = str(self._hash) == self._run.history_hash
            yield from self._synthetic.event_samples(event)

    def _state_samples(self) -> Iterator[TelemetrySample]:
        colony, batch = self._colony, self._colony.batch
        for robot in colony.robots:
            row, subpopulation = robot.row, robot.subpopulation
            snapshot = RobotSnapshot(
                agent=subpopulation.ids[robot.agent],
                energy=robot.energy,
                module=int(batch.module[row]),
                captures=int(batch.captures[row].sum()),
                pool=len(subpopulation.pool),
            )
            yield self._synthetic.state_sample(row, colony.tick, snapshot)


def initial_samples(run: PastRun) -> Iterator[TelemetrySample]:
    """Yield the first samples of any run: robots and arena come online, and reply with their metadata."""
    return _initial_samples(_synthetic_telemetry(run), run.config)


def from_history(run: PastRun) -> Iterator[TelemetrySample]:
    """Yield the telemetry that follows from a run's history alone: events, and states of robots at their turnovers.

    Positions, modules and energies are not in a history. Raises PastRunError.
    """
    synthetic = _synthetic_telemetry(run)
    yield from _initial_samples(synthetic, run.config)
    newborn = RobotSnapshot("", run.config.life.initial_energy, -1, captures=0, pool=0)
    for tick, events in itertools.groupby(read_history(run.history), lambda event: event.tick):
        turned_over: dict[int, None] = {}
        for event in events:
            yield from synthetic.event_samples(event)
            if isinstance(event, Born) and event.robot < len(run.robots):
                turned_over[event.robot] = None
        for number in turned_over:
            yield synthetic.state_sample(number, tick, newborn)


def _synthetic_telemetry(run: PastRun) -> SyntheticTelemetry:
    period_s = run.config.arena.control_period_s
    return SyntheticTelemetry(run.colony, run.robots, run.start_unix_ms, period_s)


def _initial_samples(synthetic: SyntheticTelemetry, config: Config) -> Iterator[TelemetrySample]:
    arena = settings_as_json({"arena": config.arena, "body": config.body}, MAX_ARENA_SETTINGS)
    return synthetic.initial_samples(settings_of_robot(config, config.body), arena)


def window_generations(windows: Windows, run: PastRun) -> frozenset[int]:
    """Return the generations of a run whose starts are re-simulated with scenes."""
    if windows.generations is not None:
        return windows.generations
    return frozenset((0, max(0, run.generations - 1)))


def _coarse_state_ticks(config: Config, generations: int) -> int:
    """Return the ticks between two states of a robot outside of windows."""
    ticks = config.life.agents * config.life.slices * config.life.slice_steps * generations
    ticks_per_state = math.ceil(ticks * config.robots / _MAX_COARSE_STATES)
    period = round(_COARSE_STATE_PERIOD_S / config.arena.control_period_s)
    return max(1, period, ticks_per_state)
