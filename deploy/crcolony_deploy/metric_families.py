"""What a colony's telemetry is as metrics: the families of an exporter, with their names, units and meaning."""

from collections import Counter
from collections.abc import Iterator, Mapping
from typing import NamedTuple, get_args

from prometheus_client.metrics_core import CounterMetricFamily, GaugeMetricFamily, Metric

from crcolony.protocol.encounters import Outcome
from crcolony.protocol.identity import RobotId
from crcolony.telemetry.colony_monitor import ColonyMonitor
from crcolony.telemetry.robot_status import ArenaStatus, RobotStatus

OTHER_ARENA = "other"
"""The label of an arena that has no series of its own."""


_GAUGE, _COUNTER = GaugeMetricFamily, CounterMetricFamily
Kind = type[CounterMetricFamily] | type[GaugeMetricFamily]


class StateMeasure(NamedTuple):
    """A number of a robot's state: the metric's name, the field, and what it means."""

    kind: Kind
    name: str
    field: str
    meaning: str
    scale: float = 1.0
    """By which the field is multiplied, to be in the base unit"""
    unit: str = ""
    """The end of the name"""


OF_STATE = (
    StateMeasure(_GAUGE, "energy_ratio", "energy", "Energy of the agent in control", unit="ratio"),
    StateMeasure(_GAUGE, "generation", "generation", "Generation of the subpopulation"),
    StateMeasure(_GAUGE, "number", "number", "Number in the colony, or slot"),
    StateMeasure(_GAUGE, "offspring_pool", "pool", "Offspring that wait for the next generation"),
    StateMeasure(_GAUGE, "encounters_waiting", "waiting", "Unresolved encounters"),
    StateMeasure(_GAUGE, "encounters_in_doubt", "doubts", "Unresolved encounters, of which the decision is unknown"),
    StateMeasure(_GAUGE, "encounters_orphaned", "orphaned", "Unresolved encounters whose partner did not return"),
    StateMeasure(_GAUGE, "peers", "peers", "Robots whose token it sees"),
    StateMeasure(
        _GAUGE, "control_period_seconds", "period_ms", "Time between its last two observations", 0.001, "seconds"
    ),
    StateMeasure(_GAUGE, "incarnation", "incarnation", "Ordinal of its present start"),
    StateMeasure(_COUNTER, "matings", "matings", "Matings in all incarnations"),
    StateMeasure(_COUNTER, "offspring", "conceptions", "Offspring conceived in all incarnations"),
    StateMeasure(_COUNTER, "captures", "captures", "Battery packs captured in all incarnations"),
    StateMeasure(_COUNTER, "inputs_refused", "refused", "Invalid inputs of this incarnation"),
    StateMeasure(_COUNTER, "inputs_dropped", "dropped", "Inputs of this incarnation lost because of their rate"),
    StateMeasure(_COUNTER, "faults", "faults", "External faults of this incarnation"),
)  # fmt: skip
"""The families of a robot's state, without the beginning of their names."""

_OUTCOMES: tuple[Outcome, ...] = get_args(Outcome)


class Exported(NamedTuple):
    """What is exported: names with their labels, and what was counted here."""

    robots: Mapping[RobotId, str]
    arenas: Mapping[str, str]
    colonies: Mapping[RobotId, str]
    """The colony of a robot when it first came online: what a peer says later makes no new series"""
    encounters: Mapping[RobotId, Counter[Outcome]]


def families_of_robots(
    monitor: ColonyMonitor, exported: Exported, unix_s: float
) -> Iterator[Metric]:
    """Yield the families with a series for each robot; one that the monitor has forgotten is only offline."""
    known = {robot: monitor.robots.get(robot) for robot in exported.robots}
    online = {r: float(s is not None and s.is_alive) for r, s in known.items()}
    yield _family(_GAUGE, "online", "1 if the robot is online", online, exported)
    yield _info(known, exported)
    statuses = {robot: status for robot, status in known.items() if status is not None}
    restarts = {robot: status.restarts for robot, status in statuses.items()}
    yield _family(
        _COUNTER, "restarts", "Incarnations that began while this exporter ran", restarts, exported
    )
    missed = {robot: status.missed for robot, status in statuses.items()}
    yield _family(
        _GAUGE, "events_missed", "Published events that have not arrived here", missed, exported
    )
    states = {robot: status.state for robot, status in statuses.items() if status.state is not None}
    ages = {robot: max(0.0, unix_s - statuses[robot].updated_s) for robot in states}
    yield _family(
        _GAUGE, "state_age_seconds", "Time since its state arrived", ages, exported, "seconds"
    )
    bodies = {robot: bool(state.arena) for robot, state in states.items()}
    yield _family(_GAUGE, "has_body", "1 if it has a body in an arena", bodies, exported)
    for measure in OF_STATE:
        values = {r: measure.scale * getattr(state, measure.field) for r, state in states.items()}
        yield _family(measure.kind, measure.name, measure.meaning, values, exported, measure.unit)
    yield _encounters(exported)


def families_of_arenas(
    monitor: ColonyMonitor, exported: Exported, unix_s: float
) -> Iterator[Metric]:
    """Yield the families with a series for each arena or bridge."""
    bodies = Counter(s.state.arena for s in monitor.robots.values() if s.is_alive and s.state)
    online = _GAUGE("crcolony_arena_online", "1 if the arena or bridge is online", labels=["arena"])
    robots = _GAUGE(
        "crcolony_arena_robots", "Robots that are online with a body in it", labels=["arena"]
    )
    age = _GAUGE(
        "crcolony_arena_scene_age_seconds",
        "Time since its last scene arrived",
        labels=["arena"],
        unit="seconds",
    )
    for name, label in exported.arenas.items():
        arena: ArenaStatus | None = monitor.arenas.get(name)
        online.add_metric([label], float(arena is not None and arena.is_alive))
        robots.add_metric([label], bodies[name])
        if arena is not None and arena.scene is not None:
            age.add_metric([label], max(0.0, unix_s - arena.updated_s))
    yield from (online, robots, age)


def families_of_exporter(
    monitor: ColonyMonitor, dropped: int, omitted: int, unreachable: int
) -> Iterator[Metric]:
    """Yield what the exporter knows of itself."""
    samples = _COUNTER(
        "crcolony_exporter_samples", "Samples of telemetry that were handled", labels=["kind"]
    )
    for kind, count in sorted(monitor.samples.items()):
        samples.add_metric([kind], count)
    yield samples
    for name, meaning, count in (
        ("received_bytes", "Bytes of their payloads", monitor.bytes),
        ("samples_malformed", "Samples that were no messages", monitor.malformed),
        ("samples_stale", "Samples of other incarnations than the present one", monitor.stale),
        (
            "samples_ignored",
            "Samples of robots or arenas for which there is no room",
            monitor.ignored,
        ),
        ("samples_dropped", "Samples dropped because too many waited", dropped),
    ):
        unit = "bytes" if name.endswith("bytes") else ""
        yield _COUNTER(f"crcolony_exporter_{name}", meaning, value=count, unit=unit)
    yield _GAUGE(
        "crcolony_exporter_names_omitted",
        "Robots and arenas online that have no series here",
        value=omitted,
    )
    yield _GAUGE(
        "crcolony_exporter_endpoints_unreachable",
        "Endpoints at which nobody answers",
        value=unreachable,
    )


def _family(
    kind: Kind,
    name: str,
    meaning: str,
    values: Mapping[RobotId, float],
    exported: Exported,
    unit: str = "",
) -> Metric:
    family = kind(f"crcolony_robot_{name}", meaning, labels=["colony", "robot"], unit=unit)
    for robot, value in values.items():
        family.add_metric(_labels(robot, exported), float(value))
    return family


def _labels(robot: RobotId, exported: Exported) -> list[str]:
    return [exported.colonies.get(robot, ""), exported.robots[robot]]


def _info(known: Mapping[RobotId, RobotStatus | None], exported: Exported) -> Metric:
    family = _GAUGE(
        "crcolony_robot_info",
        "Always 1: the whole id of a robot, and the arena of its body",
        labels=["colony", "robot", "id", "arena"],
    )
    for robot, status in known.items():
        name = status.state.arena if status is not None and status.state is not None else ""
        arena = exported.arenas.get(name, OTHER_ARENA) if name else ""
        family.add_metric([*_labels(robot, exported), robot.hex(), arena], 1.0)
    return family


def _encounters(exported: Exported) -> Metric:
    family = _COUNTER(
        "crcolony_robot_encounters",
        "Encounters by outcome that were published while this exporter ran",
        labels=["colony", "robot", "outcome"],
    )
    for robot in exported.robots:
        counts = exported.encounters.get(robot, Counter())
        for outcome in _OUTCOMES if robot in exported.colonies else ():
            family.add_metric([*_labels(robot, exported), outcome], counts[outcome])
    return family
