"""What the tabs of the dashboard draw: robots, arenas, colonies, recent matings, log lines and rates.

It receives the status changes of a `ColonyMonitor`; it does no I/O and reads no clock.
"""

import statistics
from collections import deque
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
from crcolony.telemetry.notices import notices
from crcolony.telemetry.peer_settings import Mind, PeerSettings
from crcolony.telemetry.robot_status import ArenaStatus, RobotStatus
from crcolony.telemetry.status_changes import EventReceived, StatusChange
from crcolony_dashboards.throttle import Throttle
from crcolony_dashboards.view_model.expected_end import ExpectedEnd, expected_end
from crcolony_dashboards.view_model.family_tree import FamilyTree
from crcolony_dashboards.view_model.gene_statistics import gene_statistics
from crcolony_dashboards.view_model.generation_history import GenerationHistory, GenerationRow
from crcolony_dashboards.view_model.generations import Generation, Generations
from crcolony_dashboards.view_model.log_buffer import LogBuffer
from crcolony_dashboards.view_model.log_lines import LogLine, format_change
from crcolony_dashboards.view_model.mating_reports import MatingReports
from crcolony_dashboards.view_model.naming import robot_names, short_id
from crcolony_dashboards.view_model.pairings import Pairing, RecentPairings
from crcolony_dashboards.view_model.plausibility import (
    MAX_SIM_S,
    is_plausible_event,
    is_plausible_scene,
)
from crcolony_dashboards.view_model.potentials import has_camera, number_of_genes
from crcolony_dashboards.view_model.rates import ColonyRates, RateCounter

MAX_COLONIES = 8
"""Drawn apart from each other; robots of further colonies are drawn but not counted"""
_MAX_DELAY_S = 5.0
"""A meeting reported later than this, by back-fill, is not drawn"""
_MAX_EVENTS = 5
"""On the first screen"""
_ROBOTS_REFRESH_S = 0.5
"""How often the list of robots, their states and names are updated"""


@dataclass
class Colony:
    """What is known of one colony."""

    name: str
    generations: Generations = field(default_factory=Generations)
    history: GenerationHistory = field(default_factory=GenerationHistory)
    family: FamilyTree = field(default_factory=FamilyTree)
    rates: ColonyRates = field(default_factory=ColonyRates)
    best: str = ""
    """The agent that mated most in the generation that ended last"""
    has_ended: bool = False
    """Whether all its robots have left: founders of the same name are then another colony"""


class ColonyView:
    """The view model of the dashboard. Status changes are passed to it in order."""

    def __init__(self, monitor: ColonyMonitor) -> None:
        self.monitor = monitor
        self.colonies: dict[str, Colony] = {}
        self.alive: list[RobotStatus] = []
        """Robots on the network, in order of their number and id"""
        self.arenas: list[ArenaStatus] = []
        """Arenas with a scene that can be drawn, in order of their name"""
        self.connection_problems: list[str] = []
        """Endpoints at which nobody answers"""
        self.notices: list[str] = []
        """What is awaited, and what cannot be reached"""
        self.activities: dict[str, str] = {}
        """What robots without a body, and arenas before their run, do: by the name that a person reads"""
        self._pairings = RecentPairings()
        self.events: deque[LogLine] = deque(maxlen=_MAX_EVENTS)
        """The last log lines, the newest last"""
        self._settings = PeerSettings()
        self._mating_reports = MatingReports()
        self._log = LogBuffer()
        self._rate_counter = RateCounter()
        self._states: dict[str, list[RobotState]] = {}
        """Of every colony the states of its robots on the network"""
        self._names: dict[RobotId, str] = {}
        self._robots_throttle = Throttle(_ROBOTS_REFRESH_S)

    # Input ----------------------------------------------------------------------------------------------------------

    def handle_change(self, change: StatusChange, unix_s: float) -> None:
        """Process one status change, received at `unix_s`."""
        line = format_change(change, self.name_of)
        if line is not None:
            self._add_line(line)
        if isinstance(change, EventReceived):
            self._handle_event(change.message, unix_s)

    def _add_line(self, line: LogLine) -> None:
        self._log.add(line)
        self.events.append(line)

    def _handle_event(self, message: EventMessage, unix_s: float) -> None:
        event = message.event
        if isinstance(event, Exchanged):
            line = self._mating_reports.add(message, event, unix_s, self.name_of)
            if line is not None:
                self._add_line(line)
        if isinstance(event, Met | Exchanged) and not self._is_late(message):
            self._pairings.add(message.robot, event, unix_s)
        colony = self.colony_of(message.robot)
        if colony is None:
            return
        if isinstance(event, Exchanged):
            colony.generations.add_mating(event)
        elif isinstance(event, Born) and is_plausible_event(event):
            if colony.has_ended and event.generation == 0:
                colony = self.colonies[colony.name] = Colony(colony.name)
            colony.has_ended = False
            colony.generations.add_birth(message.robot, event)
            colony.family.add_birth(message.robot, event)
        elif isinstance(event, Lived) and is_plausible_event(event):
            colony.generations.add_lifetime(event, unix_s)

    def _is_late(self, message: EventMessage) -> bool:
        """Return whether an event happened long before its robot's last state, by that robot's own clock."""
        status = self.monitor.robots.get(message.robot)
        state = status.state if status is not None else None
        return state is not None and state.unix_ms - message.unix_ms > 1000.0 * _MAX_DELAY_S

    def refresh(self, unix_s: float) -> None:
        """Update arenas, robots and recent pairings; called before every drawing."""
        self.arenas = [
            arena
            for _, arena in sorted(self.monitor.arenas.items())
            if arena.scene and is_plausible_scene(arena.scene)
        ]
        if self._robots_throttle.is_due(unix_s):
            self._refresh_robots()
            self._refresh_notices(unix_s)
        self._pairings.drop_old(unix_s)
        for line in self._mating_reports.pop_overdue(unix_s, self.name_of):
            self._add_line(line)

    def _refresh_robots(self) -> None:
        self.alive = self.monitor.alive
        self._states = {name: [] for name in self.colonies}
        for status in self.alive:
            if status.state is not None and self.colony_of(status.robot) is not None:
                self._states.setdefault(status.colony, []).append(status.state)
        present = {status.colony for status in self.alive}
        for name, colony in self.colonies.items():
            colony.has_ended = colony.has_ended or name not in present
        self._names = robot_names(self.monitor.robots, len(self.colonies) > 1)

    def _refresh_notices(self, unix_s: float) -> None:
        self.notices = notices(self.monitor, unix_s, self.connection_problems)
        doing = {
            f"arena {name}": arena.doing(unix_s) for name, arena in self.monitor.arenas.items()
        }
        doing |= {
            f"robot {self.name_of(robot)}": status.doing(unix_s)
            for robot, status in self.monitor.robots.items()
        }
        self.activities = {name: text for name, text in sorted(doing.items()) if text}

    def update_rates(self, unix_s: float) -> None:
        """Count matings and captures from the robots' states; called about once a second."""
        for status in self.alive:
            colony = self.colony_of(status.robot)
            if status.state is not None and colony is not None:
                self._rate_counter.count(status.robot, status.state, colony.rates)
        self._rate_counter.drop_absent(self.monitor.robots)
        arena = self.arenas[0].name if self.arenas else ""
        self._rate_counter.set_clock(arena, [colony.rates for colony in self.colonies.values()])
        sim_s = self.sim_s()
        minutes = (unix_s if sim_s is None else sim_s) / 60.0
        for colony in self.colonies.values():
            colony.rates.add_sample(unix_s, minutes, len(self.states(colony.name)))

    def update_generations(self, unix_s: float) -> None:
        """Add the generations that have ended to the histories of their colonies; called about once a second."""
        for colony in self.colonies.values():
            present = {state.robot: state.generation for state in self.states(colony.name)}
            for generation in colony.generations.pop_ended(present, unix_s):
                colony.best = generation.best
                colony.history.add(self._row(colony, generation))

    def _row(self, colony: Colony, generation: Generation) -> GenerationRow:
        mind = self.mind_of(colony, generation.genotypes.shape[-1])
        return GenerationRow(
            number=generation.number,
            agents=generation.agents,
            matings=generation.matings,
            captures=generation.captures,
            conceptions=generation.conceptions,
            energy=generation.energy,
            genes=gene_statistics(generation.genotypes, mind) if mind is not None else None,
        )

    # Output ---------------------------------------------------------------------------------------------------------

    def name_of(self, robot: RobotId) -> str:
        """Return the displayed name of a robot."""
        return self._names.get(robot, short_id(robot))

    @property
    def pairings(self) -> deque[Pairing]:
        """Meetings and matings of the last moments, the oldest first."""
        return self._pairings.recent

    def colony_of(self, robot: RobotId) -> Colony | None:
        """Return the colony of a robot, which is added if there is room; None if there is none."""
        status = self.monitor.robots.get(robot)
        if status is None:
            return None
        colony = self.colonies.get(status.colony)
        if colony is not None or not self._make_room():
            return colony
        colony = self.colonies[status.colony] = Colony(status.colony)
        return colony

    def _make_room(self) -> bool:
        """Drop a colony that has ended if there are too many; return whether there is room for one more."""
        if len(self.colonies) >= MAX_COLONIES:
            ended = next((name for name, colony in self.colonies.items() if colony.has_ended), None)
            if ended is None:
                return False
            del self.colonies[ended]
        return True

    def pop_log_lines(self) -> list[LogLine]:
        """Return the log lines since the last call; called once a second."""
        return self._log.pop_lines()

    def mind_of(self, colony: Colony, genes: int) -> Mind | None:
        """Return the settings by which genotypes of so many genes are read, as one of the colony's robots has them."""
        for status in self.alive:
            mind = (
                self._settings.of_robot(status.metadata) if status.colony == colony.name else None
            )
            if mind is not None and has_camera(mind) and number_of_genes(mind) == genes:
                return mind
        return None

    def expected_end(self, colony: Colony) -> ExpectedEnd | None:
        """Return when the present generation of a colony ends; None if that is unknown."""
        robots = (status for status in self.alive if status.colony == colony.name)
        lives = (self._settings.life_of(status.metadata) for status in robots)
        life = next((life for life in lives if life is not None), None)
        return expected_end(self.states(colony.name), colony.generations.starts, life)

    def main_colony(self) -> Colony | None:
        """Return the colony with most robots on the network, whose details are drawn; None without colonies."""
        colonies = sorted(self.colonies.values(), key=lambda colony: colony.name)
        return max(colonies, key=lambda colony: len(self.states(colony.name)), default=None)

    def states(self, colony: str | None = None) -> list[RobotState]:
        """Return the states of the robots on the network, of one colony or of all."""
        if colony is not None:
            return self._states.get(colony, [])
        return [state for states in self._states.values() for state in states]

    def scenes(self) -> list[Scene]:
        """Return the last scene of every arena, in order of the arenas' names."""
        return [arena.scene for arena in self.arenas if arena.scene is not None]

    def is_stale(self, status: RobotStatus | None, unix_s: float) -> bool:
        """Return whether a robot is offline, or no state of it was received for a while."""
        return status is None or not status.is_alive or unix_s - status.updated_s > SILENT_AFTER_S

    def sim_s(self) -> float | None:
        """Return the time of the first arena, None without one: that of its scene, or later if its robots are."""
        scenes = self.scenes()
        if not scenes:
            return None
        ticks = [state.tick for state in self.states() if state.arena == scenes[0].arena]
        tick = max(scenes[0].tick, statistics.median_low(ticks or [0]))
        return min(tick * scenes[0].period_s, MAX_SIM_S)

    def period_s(self) -> float | None:
        """Return the control period of the first arena; None without an arena."""
        scenes = self.scenes()
        return scenes[0].period_s if scenes else None

    def generation(self) -> int:
        """Return the lowest generation of all robots on the network; 0 without robots."""
        return min((state.generation for state in self.states()), default=0)
