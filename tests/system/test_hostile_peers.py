"""No peer can crash a robot, stall its control loop, keep it from mating, or grow its memory: an attack for each test.

Four robots run in real time and mate several times a second. Without an attack all of their encounters become matings;
nearly all must under attack, too, and no later. The bounds leave room for a noisy machine, and for how little happens
in a few seconds; `python -m tests.system.report_hostile` prints the measurements.
"""

import json
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.attack import siege
from tests.support.besieged import ATTACK_S, Besieged
from tests.support.hostile_bodies import HALF_OPEN
from tests.support.mating_audit import check_ledger
from tests.support.process import Process, wait_until
from tests.support.process_colony import settle

TRUTH_S = 5.0
"""After an adversary has gone observers believe nothing any more that it has made up."""

pytestmark = pytest.mark.alone


@pytest.fixture(scope="module")
def besieged(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Besieged]:
    """A colony for all attacks; afterwards its ledger is exact."""
    with siege(tmp_path_factory.mktemp("siege")) as made:
        yield Besieged(made, [made.monitor(ATTACK_S)])
        settle(made.made, made.view)
        made.made.stop_robots()
        check_ledger(made.made.stores)


def test_messages_that_are_too_long_are_not_even_kept(besieged: Besieged) -> None:
    """From one byte too many to megabytes, as envelopes, observations and queries."""
    besieged.refuses("oversized")


def test_malformed_envelopes_are_refused(besieged: Besieged) -> None:
    """Noise, and genuine envelopes with bits flipped, truncated or extended: 500 a second."""
    besieged.refuses("malformed")


def test_invalid_genes_lead_to_no_conception(besieged: Besieged) -> None:
    """NaN, infinite, out of range, too many, too few: validly signed, with a real nonce, by a robot never met."""
    besieged.withstands("unfit")


def test_an_impostor_is_refused(besieged: Besieged) -> None:
    """Envelopes in a robot's name, with another key or an invalid signature, and the nonce of a real contact."""
    besieged.refuses("impostor")


def test_replayed_envelopes_have_no_effect(besieged: Besieged) -> None:
    """Sent to their receivers and to others: no mating is decided twice, as the ledger shows in the end."""
    besieged.withstands("replay")


def test_a_past_contact_has_no_effect(besieged: Besieged) -> None:
    """Proposals with the nonce of a contact that is over, or of a contact between others."""
    besieged.withstands("stale")


def test_ten_thousand_envelopes_a_second_delay_no_control_step(besieged: Besieged) -> None:
    """Validly signed proposals of two thousand made-up robots, among replays."""
    besieged.withstands("flood")


def test_made_up_robots_that_request_bodies_disturb_no_robot(besieged: Besieged) -> None:
    """Two thousand requests a second, half of them noise: all robots keep their bodies, and the arena logs little."""
    arena, *robots = besieged.siege.honest
    before, lost = len(arena.output), [robot.output.count("is offline") for robot in robots]
    besieged.withstands("joins")
    assert [robot.output.count("is offline") for robot in robots] == lost
    assert len(arena.output) - before < 100_000


def test_queries_without_end_are_answered_at_a_limited_rate(besieged: Besieged) -> None:
    """A thousand history queries a second, half of them noise."""
    besieged.withstands("queries")


def test_observations_of_another_arena_run_or_tick_are_ignored(besieged: Besieged) -> None:
    """And those with NaN, or noise, and those of the right run and tick: nobody else has the key of the link."""
    _, before = besieged.withstands("observations")
    for robot, earlier in zip(besieged.states(), before, strict=True):
        assert robot.faults > earlier.faults


def test_an_observation_from_the_future_is_not_believed(besieged: Besieged) -> None:
    """No robot is deaf for a moment."""
    besieged.withstands("future")
    assert all(robot.tick < 2**50 for robot in besieged.states())


def test_forged_telemetry_harms_observers_at_most(besieged: Besieged, tmp_path: Path) -> None:
    """Robots do not receive telemetry; and `crcolony status` still lists the robots that are online."""
    with besieged.siege.attacked("telemetry"):
        made = besieged.siege.made
        status = made.start("status", "status", "--connect", made.endpoint)
        assert status.wait(30.0) == 0
    besieged.withstands("telemetry")
    for robot in besieged.siege.made.robots:
        assert robot.id.hex()[:8] in status.output


def test_a_forged_token_does_not_stop_a_robot(besieged: Besieged) -> None:
    """A liveliness token in a robot's name, of an older incarnation, proves nothing: the robot continues."""
    besieged.withstands("tokens")


def test_observers_tell_the_truth_as_soon_as_an_adversary_has_gone(besieged: Besieged) -> None:
    """One that watched all the time, and one that asks within five seconds: what was made up ends with its maker."""
    made, view = besieged.siege.made, besieged.siege.view
    with besieged.siege.attacked("tokens,telemetry,arena_tokens,impostor_arena"):
        besieged.siege.monitor(ATTACK_S)
    gone_s, ticks = time.monotonic(), {robot.robot: robot.tick for robot in besieged.states()}
    asked_s: list[float] = []

    def is_told() -> bool:
        asked_s.append(time.monotonic())
        status = made.start("status", "status", "--json", "--connect", made.endpoint)
        assert status.wait() == 0, status.output
        told = json.loads(status.output)
        alive = {robot["id"]: robot["arena"] for robot in told["robots"] if robot["alive"]}
        arenas = [arena["name"] for arena in told["arenas"] if arena["alive"]]
        return alive == {robot.id.hex(): "arena" for robot in made.robots} and arenas == ["arena"]

    wait_until(is_told, "status lists the four robots and their arena")
    assert asked_s[-1] <= gone_s + TRUTH_S
    view.update()
    assert all(view.states[robot].tick > tick for robot, tick in ticks.items())
    besieged.withstands("tokens,telemetry,arena_tokens,impostor_arena")


# The link to the body ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("attack", ["evictions", "steering", "contacts", "arena_tokens"])
def test_nobody_speaks_for_a_robot_or_its_arena(besieged: Besieged, attack: str) -> None:
    """Forged and replayed requests, actions, observations and tokens: no body is lost, and matings go on."""
    _, *robots = besieged.siege.honest
    bodies = [robot.output.count("has body") for robot in robots]
    besieged.withstands(attack)
    assert [robot.output.count("has body") for robot in robots] == bodies
    for robot in robots:
        assert "colony another" not in robot.output


def test_no_robot_lives_in_an_impostor_of_its_arena(besieged: Besieged) -> None:
    """It grants a body to all that ask; a robot that comes back during the attack asks on until it has its own."""
    *_, robot = besieged.siege.made.robots
    with besieged.siege.attacked("impostor_arena"):
        robot.kill()
        robot.start()
        robot.wait_for("mated with")
        assert robot.output.count("has body") == 1
    besieged.withstands("impostor_arena")


def test_a_newcomer_gets_in_whatever_is_half_open(besieged: Besieged) -> None:
    """Fifteen hundred connections on which nothing is said keep nobody out."""
    *_, robot = besieged.siege.made.robots
    with besieged.siege.attacked("half_open") as hostile:
        wait_until(lambda: _shots(hostile) > HALF_OPEN, "all are open")
        robot.kill()
        robot.start()
        robot.wait_for("mated with", within_s=60.0)
    besieged.withstands("half_open")


def test_tokens_with_long_keys_cost_little_memory(besieged: Besieged) -> None:
    """Two hundred of 50 kB at a time, which come and go."""
    besieged.withstands("long_tokens")


def _shots(hostile: Process) -> int:
    counts = [line.split()[0] for line in hostile.output.splitlines() if line.endswith(" shots")]
    return int(counts[-1]) if counts else 0
