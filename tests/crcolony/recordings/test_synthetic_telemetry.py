"""Synthetic samples are those that robots would have published."""

from crcolony.evolution.history import Born, Died, Lived, Mated, TurnedOver
from crcolony.protocol.identity import seeded
from crcolony.protocol.telemetry_messages import Exchanged, Met
from crcolony.recordings.synthetic_telemetry import (
    RobotSnapshot,
    SyntheticTelemetry,
    agent_with_robot_id,
    with_robot_ids,
)
from crcolony.telemetry.samples import StateSample, TelemetrySample, parse_sample
from tests.support.raw_samples import raw_sample
from tests.support.runs import event_messages

ROBOTS = [seeded("colony", 1, number).id for number in range(2)]
START_MS = 1_790_000_000_000
MATED = Mated(50, 1, 0, "1/2", "0/3", 0.5, 0.75, True, False)


def synthetic() -> SyntheticTelemetry:
    return SyntheticTelemetry("colony", ROBOTS, START_MS, 0.2)


def test_samples_are_those_of_the_network(short_samples: list[TelemetrySample]) -> None:
    """Their keys and payloads are valid, and are parsed to the same samples."""
    for sample in short_samples:
        assert parse_sample(raw_sample(sample)) == sample


def test_a_mating_is_published_by_both_robots() -> None:
    """Each reports the contact and then its side; the robot with the smaller id is the initiator."""
    messages = event_messages(synthetic().event_samples(MATED))
    assert [message.robot for message in messages] == [ROBOTS[1]] * 2 + [ROBOTS[0]] * 2
    assert [type(message.event) for message in messages] == [Met, Exchanged] * 2
    own, partners = messages[1].event, messages[3].event
    assert isinstance(own, Exchanged)
    assert isinstance(partners, Exchanged)
    assert own.encounter == partners.encounter
    assert own.encounter.initiator == min(ROBOTS)
    assert (own.energy, own.conceived) == (0.5, True)
    assert (partners.energy, partners.conceived) == (0.75, False)
    assert own.agent == partners.partner == f"{ROBOTS[1].hex()}/2"


def test_events_are_numbered_and_timed() -> None:
    """Each robot counts its own; tick 50 is 10 s after the start."""
    telemetry = synthetic()
    events = (Died(50, 0, "0/1"), Died(50, 1, "1/1"), Died(55, 0, "0/2"))
    samples = [sample for event in events for sample in telemetry.event_samples(event)]
    messages = event_messages(samples)
    assert [(m.robot, m.seq) for m in messages] == [(ROBOTS[0], 1), (ROBOTS[1], 1), (ROBOTS[0], 2)]
    assert [sample.unix_ms - START_MS for sample in samples] == [10_000, 10_000, 11_000]


def test_a_state_counts_the_events() -> None:
    """Those of all generations, and the captures of the present one."""
    telemetry = synthetic()
    events = (
        MATED,
        Lived(60, 1, 0, "1/2", 50, 0.5, 4, 1),
        TurnedOver(60, 1, 1, 3),
        Born(60, 1, 1, "1/9", "", b"", "1/2", "0/3"),
    )
    for event in events:
        list(telemetry.event_samples(event))
    sample = telemetry.state_sample(1, 70, RobotSnapshot("1/9", 0.5, 1, captures=2, pool=3))
    assert isinstance(sample, StateSample)
    state = sample.state
    assert (state.matings, state.conceptions, state.captures) == (1, 1, 6)
    assert (state.seq, state.generation, state.pool, state.tick) == (5, 1, 3, 70)
    assert state.agent == f"{ROBOTS[1].hex()}/9"


def test_robots_without_ids_have_no_samples() -> None:
    """Neither events of their own nor matings with them."""
    telemetry = synthetic()
    assert list(telemetry.event_samples(Died(1, 2, "2/0"))) == []
    assert list(telemetry.event_samples(Mated(1, 0, 2, "0/1", "2/1", 0.5, 0.5, True, True))) == []


def test_the_names_of_agents_begin_with_ids() -> None:
    """Parents, too; a name without the number of a known robot stays as it is."""
    birth = with_robot_ids(Born(1, 0, 1, "0/9", "", b"", "1/2", None), ROBOTS)
    assert (birth.agent, birth.mother) == (f"{ROBOTS[0].hex()}/9", f"{ROBOTS[1].hex()}/2")
    assert birth.father is None
    for name in ("2/1", "", "x/1", "²/1", "123456789/1"):
        assert agent_with_robot_id(name, ROBOTS) == name
