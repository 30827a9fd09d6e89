"""The telemetry of a colony is shown as metrics, and no peer can make more series than there is room for."""

import msgspec
import pytest
from crcolony_deploy.exported_series import MAX_ROBOTS
from crcolony_deploy.metrics_exporter import MetricsExporter
from prometheus_client.openmetrics.exposition import generate_latest
from prometheus_client.openmetrics.parser import text_string_to_metric_families
from prometheus_client.registry import CollectorRegistry

from crcolony.protocol.codec import Message
from crcolony.protocol.identity import RobotId
from crcolony.protocol.key_expressions import ColonyKeys
from crcolony.protocol.mating_messages import Encounter
from crcolony.protocol.telemetry_messages import EncounterOutcome, EventMessage
from crcolony.telemetry.presence import FORGET_S
from tests.support.fed_monitor import A_SCENE, ARENA, COLONY, ME, PEER, FedMonitor, T, state


class Shown:
    """What an exporter shows: every sample, by its name and labels."""

    def __init__(self, exporter: MetricsExporter) -> None:
        registry = CollectorRegistry()
        registry.register(exporter)
        text: bytes = generate_latest(registry)  # type: ignore[no-untyped-call]
        self.samples = {
            (sample.name, tuple(sorted(sample.labels.items()))): sample.value
            for family in text_string_to_metric_families(text.decode())  # type: ignore[no-untyped-call]
            for sample in family.samples
        }

    def of(self, name: str, robot: RobotId = ME, **labels: str) -> float | None:
        """Return a value of a robot of colony blue."""
        every = {"colony": "blue", "robot": robot.hex()[:8], **labels}
        return self.samples.get((f"crcolony_robot_{name}", tuple(sorted(every.items()))))

    def plain(self, name: str, **labels: str) -> float | None:
        return self.samples.get((f"crcolony_{name}", tuple(sorted(labels.items()))))


@pytest.fixture
def monitor() -> FedMonitor:
    """Two robots online, one of which has published its state, and an arena."""
    monitor = FedMonitor()
    monitor.online(3, ME)
    monitor.online(3, PEER)
    changes = {"energy": 0.5, "matings": 6, "conceptions": 2, "arena": "lab", "period_ms": 200.0}
    monitor.state(msgspec.structs.replace(state(), **changes))
    monitor.handle("online", ARENA.alive(7, "a"))
    monitor.handle("scene", ARENA.scene, A_SCENE)
    return monitor


def exporter_of(monitor: FedMonitor, *expected: RobotId) -> MetricsExporter:
    return MetricsExporter(monitor, expected or None, clock=lambda: monitor.now_s)


def test_the_state_of_a_robot_is_shown_in_base_units(monitor: FedMonitor) -> None:
    """Ratios from 0 to 1, seconds, and counters that end in _total."""
    exporter = exporter_of(monitor)
    monitor.now_s = T + 1.5
    shown = Shown(exporter)
    assert shown.of("energy_ratio") == 0.5
    assert shown.of("control_period_seconds") == 0.2
    assert (shown.of("matings_total"), shown.of("offspring_total")) == (6, 2)
    assert shown.of("state_age_seconds") == 1.5
    assert shown.of("info", id=ME.hex(), arena="lab") == 1
    assert shown.plain("arena_online", arena="lab") == 1
    assert shown.plain("arena_robots", arena="lab") == 1


def test_a_robot_that_has_published_nothing_is_only_online(monitor: FedMonitor) -> None:
    """It has no energy, not an energy of 0."""
    shown = Shown(exporter_of(monitor))
    assert shown.of("online", PEER) == 1
    assert shown.of("energy_ratio", PEER) is None


def test_a_robot_that_is_gone_for_good_stays_offline(monitor: FedMonitor) -> None:
    """The monitor forgets it after ten minutes; the alert that it is offline must not end then."""
    exporter = exporter_of(monitor)
    Shown(exporter)
    monitor.offline(3, ME)
    monitor.now_s += FORGET_S + 1.0
    monitor.handle_timeouts(monitor.now_s)
    assert ME not in monitor.robots
    assert Shown(exporter).of("online") == 0


def test_an_expected_robot_that_was_never_there_is_offline() -> None:
    """Its colony is not known, so its label is empty; strangers are counted, and have no series."""
    monitor = FedMonitor()
    monitor.online(3, PEER)
    shown = Shown(exporter_of(monitor, ME))
    assert shown.of("online", colony="") == 0
    assert shown.of("online", PEER) is None
    assert shown.plain("exporter_names_omitted") == 1


def outcome(seq: int, what: str, robot: RobotId = ME) -> EventMessage:
    event = EncounterOutcome(seq, what, PEER, Encounter(robot, PEER, 3, seq), "")  # type: ignore[arg-type]
    return EventMessage(robot, 3, seq, 7, event)


def test_encounters_are_counted_by_outcome(monitor: FedMonitor) -> None:
    """All outcomes are there from the start, at 0, so that the first of a kind is an increase."""
    exporter = exporter_of(monitor)
    exporter.handle_changes([])
    assert Shown(exporter).of("encounters_total", outcome="doubt") == 0
    for message in (outcome(1, "mated"), outcome(2, "doubt"), outcome(3, "mated")):
        exporter.handle_changes(monitor.handle("event", COLONY.event(ME), message))
    shown = Shown(exporter)
    assert shown.of("encounters_total", outcome="mated") == 2
    assert shown.of("encounters_total", outcome="doubt") == 1
    assert shown.of("encounters_total", outcome="refused") == 0


def hostile(monitor: FedMonitor, number: int) -> None:
    """A peer makes up a robot: its token, in a colony of its own, and a state in an arena of its own."""
    robot, keys = number.to_bytes(16), ColonyKeys(f"colony{number}")
    forged: Message = msgspec.structs.replace(state(robot=robot), arena=f"arena{number}")
    monitor.handle("online", keys.alive(robot, 3, "a"))
    monitor.handle("state", keys.state(robot), forged)


def test_a_hostile_peer_makes_a_bounded_number_of_series(monitor: FedMonitor) -> None:
    """Robots, colonies and arenas by the thousand: those who were first keep their series, and the output its bound."""
    exporter = exporter_of(monitor)
    exporter.handle_changes([])
    for number in range(3 * MAX_ROBOTS):
        hostile(monitor, number)
    shown = Shown(exporter)
    of_each = sum(dict(labels).get("robot") == ME.hex()[:8] for _, labels in shown.samples)
    assert len(shown.samples) < (of_each + 1) * MAX_ROBOTS < 40_000, "the limit of prometheus.yml"
    assert shown.of("energy_ratio") == 0.5
    assert {dict(labels)["arena"] for _, labels in shown.samples if "arena" in dict(labels)} == {
        "lab",
        "other",
        "",
    }
    omitted = shown.plain("exporter_names_omitted")
    assert omitted is not None
    assert omitted > MAX_ROBOTS


def test_a_robot_keeps_the_colony_that_it_had_first(monitor: FedMonitor) -> None:
    """Whatever colonies others say it has: each would be a new series."""
    exporter = exporter_of(monitor)
    exporter.handle_changes([])
    for number in range(20):
        monitor.handle("online", ColonyKeys(f"forged{number}").alive(ME, 3, f"s{number}"))
    colonies = {dict(labels).get("colony") for _, labels in Shown(exporter).samples}
    assert colonies == {"blue", None}
