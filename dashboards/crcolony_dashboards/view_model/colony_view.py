"""What somebody sees who watches colonies: who has just met and mated, what has ended, what was said, how fast it goes.

Fed with news (`colony/watch.py`) and asked by the tabs of the dashboard. No I/O and no clock.
"""

import statistics
from collections import Counter, deque
from dataclasses import dataclass, field

from crcolony.evolution.history import Born, Lived
from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import (
    SILENT_AFTER_S,
    EventMessage,
    Exchanged,
    Met,
    RobotState,
    Scene,
)
from crcolony.telemetry.colony_monitor import ColonyMonitor
from crcolony.telemetry.robot_status import ArenaStatus, RobotStatus
from crcolony.telemetry.status_changes import EventReceived, StatusChange
from crcolony_dashboards.throttle import Throttle
from crcolony_dashboards.view_model.family_tree import FamilyTree
from crcolony_dashboards.view_model.generations import Generation, Generations
from crcolony_dashboards.view_model.log_lines import Line, in_words
from crcolony_dashboards.view_model.plausibility import MAX_S, is_sound_event, is_sound_scene

MAX_COLONIES = 8
"""That are told apart; of more, the first"""
MATING_S, MEETING_S = 1.5, 0.6
"""How long a mating and a meeting are shown"""
_LINES_PER_S = 8
"""Of one kind in the log"""
_WINDOW_S = 60.0
"""Rates are of so much of the past"""
_MAX_PAIRS = 2_000
_NEWS_S = 5.0
"""A meeting that is told so late is not shown: it was missed, or was before anybody watched"""


@dataclass
class Pairing:
    """Two robots that met, or mated: told by both of them, shown once."""

    robots: tuple[RobotId, RobotId]
    unix_s: float
    mated: bool = False
    conceived: int = 0
    """By how many of the two"""


@dataclass(frozen=True)
class Sample:
    """How far a colony was at one moment."""

    minutes: float
    """Of the colony's own time"""
    robot_minutes: float
    """Of all its robots together"""
    matings: float
    captures: float


@dataclass
class Colony:
    """One of the colonies that are watched."""

    name: str
    generations: Generations = field(default_factory=Generations)
    family: FamilyTree = field(default_factory=FamilyTree)
    matings: float = 0.0
    captures: float = 0.0
    samples: deque[tuple[float, Sample]] = field(default_factory=deque)
    best: str = ""
    """Who mated most in the generation that ended last"""
    is_over: bool = False
    """Whether all its robots have gone: one of that name that begins with founders is another"""


class ColonyView:
    """Takes news, in order, and knows what the dashboard draws."""

    def __init__(self, monitor: ColonyMonitor) -> None:
        self.monitor = monitor
        self.colonies: dict[str, Colony] = {}
        self.pairings: deque[Pairing] = deque(maxlen=_MAX_PAIRS)
        """Meetings and matings of the last moments, the oldest first"""
        self._known_pairings: dict[object, Pairing] = {}
        self._lines: list[Line] = []
        self._said: Counter[str] = Counter()
        self._counted: dict[RobotId, RobotState] = {}
        self._clock = ""
        """The arena whose time it is; empty: nobody's but the wall's"""
        self.alive: list[RobotStatus] = []
        """Who is on the network, in order of their number and id"""
        self.arenas: list[ArenaStatus] = []
        """Of which anything was seen that can be drawn, in order of their name"""
        self._states: dict[str, list[RobotState]] = {}
        self._names: dict[RobotId, str] = {}
        self._looking = Throttle(0.5)

    # What comes in --------------------------------------------------------------------------------------------------

    def handle_change(self, changes: StatusChange, unix_s: float) -> None:
        """Take one piece of news."""
        line = in_words(changes, self.call)
        if line is not None:
            self._said[line.kind] += 1
            if self._said[line.kind] <= _LINES_PER_S:
                self._lines.append(line)
        if isinstance(changes, EventReceived):
            self._happened(changes, unix_s)

    def _happened(self, changes: EventReceived, unix_s: float) -> None:
        message, event = changes.message, changes.message.event
        if isinstance(event, Met | Exchanged) and not self._is_long_ago(message):
            self._show(message.robot, event, unix_s)
        colony = self.colony_of(message.robot)
        if colony is None:
            return
        if isinstance(event, Exchanged):
            colony.generations.add_mating(event)
        elif isinstance(event, Born) and is_sound_event(event):
            if colony.is_over and event.generation == 0:
                colony = self.colonies[colony.name] = Colony(colony.name)
            colony.is_over = False
            colony.generations.add_birth(message.robot, event)
            colony.family.add_birth(message.robot, event)
        elif isinstance(event, Lived) and is_sound_event(event):
            colony.generations.add_lifetime(event, message.unix_ms / 1000.0, unix_s)

    def _is_long_ago(self, message: EventMessage) -> bool:
        """Tell whether something was missed and is told only now, by the clock of who tells it."""
        status = self.monitor.robots.get(message.robot)
        state = status.state if status is not None else None
        return state is not None and state.unix_ms - message.unix_ms > 1000.0 * _NEWS_S

    def _show(self, robot: RobotId, event: Met | Exchanged, unix_s: float) -> None:
        if isinstance(event, Met):
            low, high = sorted((robot, event.peer))
            self._pair((low, high), (low, high), unix_s)
        else:
            both = (event.encounter.initiator, event.encounter.responder)
            pairing = self._pair(event.encounter, both, unix_s)
            pairing.mated = True
            pairing.conceived += event.conceived

    def _pair(self, key: object, robots: tuple[RobotId, RobotId], unix_s: float) -> Pairing:
        known = self._known_pairings.get(key)
        if known is not None and (known.mated or abs(unix_s - known.unix_s) < MEETING_S):
            return known
        pairing = Pairing(robots, unix_s)
        self._known_pairings[key] = pairing
        self.pairings.append(pairing)
        return pairing

    def refresh(self, unix_s: float) -> None:
        """See who is there now, and forget what was shown long enough."""
        arenas = self.monitor.arenas
        scenes = {name: arena.scene for name, arena in sorted(arenas.items())}
        self.arenas = [
            arenas[name] for name, scene in scenes.items() if scene and is_sound_scene(scene)
        ]
        if self._looking.is_due(unix_s):
            self._look_at_robots()
        while self.pairings and abs(unix_s - self.pairings[0].unix_s) > MATING_S:
            self.pairings.popleft()
        if len(self._known_pairings) > 2 * _MAX_PAIRS:
            recent = unix_s - 10.0
            self._known_pairings = {
                key: known for key, known in self._known_pairings.items() if known.unix_s > recent
            }

    def _look_at_robots(self) -> None:
        self.alive = self.monitor.alive
        self._states = {name: [] for name in self.colonies}
        for status in self.alive:
            if status.state is not None and self.colony_of(status.robot) is not None:
                self._states.setdefault(status.colony, []).append(status.state)
        present = {status.colony for status in self.alive}
        for name, colony in self.colonies.items():
            colony.is_over = colony.is_over or name not in present
        self._names = self._name_all()

    # What there is to draw ------------------------------------------------------------------------------------------

    def call(self, robot: RobotId) -> str:
        """Return how a robot is called: by its number, if it alone has it, with its colony if there are several."""
        return self._names.get(robot, robot.hex()[:8])

    def _name_all(self) -> dict[RobotId, str]:
        numbers = Counter(
            (w.colony, w.state.number) for w in self.monitor.robots.values() if w.state
        )
        names = {}
        for robot, status in self.monitor.robots.items():
            number = status.state.number if status.state is not None else None
            is_own = number is not None and numbers[status.colony, number] == 1
            name = f"#{number}" if is_own else robot.hex()[:8]
            names[robot] = f"{status.colony} {name}" if len(self.colonies) > 1 else name
        return names

    def colony_of(self, robot: RobotId) -> Colony | None:
        """Return the colony of a robot, if it is one of those that are told apart."""
        status = self.monitor.robots.get(robot)
        if status is None:
            return None
        colony = self.colonies.get(status.colony)
        if colony is not None or not self._has_room():
            return colony
        colony = self.colonies[status.colony] = Colony(status.colony)
        return colony

    def _has_room(self) -> bool:
        """Make room for one more colony, if one of those that are told apart is over."""
        if len(self.colonies) >= MAX_COLONIES:
            over = next((name for name, colony in self.colonies.items() if colony.is_over), None)
            if over is None:
                return False
            del self.colonies[over]
        return True

    def take_log_lines(self) -> list[Line]:
        """Return what was said since the last time, with how much more of it there was; ask once a second."""
        lines, self._lines = self._lines, []
        for kind, count in self._said.items():
            if count > _LINES_PER_S:
                lines.append(Line(kind, f"… and {count - _LINES_PER_S} more ({kind})"))
        self._said.clear()
        return lines

    def take_ended_generations(self, unix_s: float) -> list[tuple[Colony, Generation]]:
        """Return the generations that are over since the last time."""
        over = []
        for colony in self.colonies.values():
            present = {state.robot: state.generation for state in self.states(colony.name)}
            for generation in colony.generations.take_ended(present, unix_s):
                colony.best = generation.best
                over.append((colony, generation))
        return over

    def states(self, colony: str | None = None) -> list[RobotState]:
        """Return how those are who are on the network, of one colony or all that are told apart."""
        if colony is not None:
            return self._states.get(colony, [])
        return [state for states in self._states.values() for state in states]

    def scenes(self) -> list[Scene]:
        """Return the arenas as they were seen last, in order of their names."""
        return [arena.scene for arena in self.arenas if arena.scene is not None]

    def is_stale(self, status: RobotStatus | None, unix_s: float) -> bool:
        """Tell whether nothing was heard of a robot for a while."""
        return status is None or not status.is_alive or unix_s - status.updated_s > SILENT_AFTER_S

    def sim_s(self) -> float | None:
        """Return the time of the first arena, as it says or, if it has fallen silent, as its robots say; else None."""
        if not self.arenas or self.arenas[0].scene is None:
            return None
        scene = self.arenas[0].scene
        ticks = [state.tick for state in self.states() if state.arena == scene.arena]
        tick = max(scene.tick, statistics.median_low(ticks or [0]))
        return min(tick * scene.period_s, MAX_S)

    def period_s(self) -> float | None:
        """Return the control period of the first arena, if there is one."""
        scenes = self.scenes()
        return scenes[0].period_s if scenes else None

    def generation(self) -> int:
        """Return the generation that the last robot of all has reached."""
        return min((state.generation for state in self.states()), default=0)

    def update_rates(self, unix_s: float) -> None:
        """Count matings and captures on, from what robots tell of themselves; called once a second or so."""
        for status in self.alive:
            state, colony = status.state, self.colony_of(status.robot)
            before = self._counted.get(status.robot)
            if state is None or colony is None or state is before:
                continue
            self._counted[status.robot] = state
            if before is not None:
                colony.matings += max(0, state.matings - before.matings) / 2.0
                colony.captures += max(0, state.captures - before.captures)
        if len(self._counted) > len(self.monitor.robots):
            robots = self.monitor.robots
            self._counted = {who: state for who, state in self._counted.items() if who in robots}
        self._sample(unix_s)

    def _sample(self, unix_s: float) -> None:
        """Note how far every colony is, by the clock that there is; by another clock it is noted anew."""
        sim_s, clock = self.sim_s(), self.arenas[0].name if self.arenas else ""
        if clock != self._clock:
            self._clock = clock
            for colony in self.colonies.values():
                colony.samples.clear()
        minutes = (unix_s if sim_s is None else sim_s) / 60.0
        for colony in self.colonies.values():
            robots = len(self.states(colony.name))
            earlier = colony.samples[-1][1] if colony.samples else None
            passed = max(0.0, minutes - earlier.minutes) if earlier else 0.0
            robot_minutes = (earlier.robot_minutes if earlier else 0.0) + passed * robots
            sample = Sample(minutes, robot_minutes, colony.matings, colony.captures)
            colony.samples.append((unix_s, sample))
            while unix_s - colony.samples[0][0] > _WINDOW_S:
                colony.samples.popleft()

    def rates(self, colony: Colony) -> tuple[float, float] | None:
        """Return matings and captures of a robot in a minute of the colony's own time."""
        if len(colony.samples) < 2:
            return None
        first, last = colony.samples[0][1], colony.samples[-1][1]
        minutes = last.robot_minutes - first.robot_minutes
        if minutes <= 0.0:
            return None
        return (
            2.0 * (last.matings - first.matings) / minutes,
            (last.captures - first.captures) / minutes,
        )
