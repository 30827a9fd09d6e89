"""Against a colony with certificates hostile peers get nowhere: outside no link at all, inside no other's voice.

The insider is a robot with a certificate that obeys no access control itself, and that has overheard everything, as no
robot could. It sends all that `tests/support/hostile_peer.py` knows to send.
"""

import json
import re
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from crcolony.protocol.identity import Identity
from crcolony.protocol.key_expressions import ArenaKeys, ColonyKeys
from crcolony.transport.close_session import closing
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import has_links, open_session
from tests.support.attack import secured_siege
from tests.support.besieged import Besieged
from tests.support.deployment import Deployment
from tests.support.lawless_session import open_lawless_session, open_session_without_certificate
from tests.support.linked_robot import forged_leave
from tests.support.mating_audit import check_ledger
from tests.support.observer import Token
from tests.support.process_colony import settle
from tests.support.spy import Spy

pytestmark = pytest.mark.alone

COLONY, ARENA = ColonyKeys("colony"), ArenaKeys("arena")
DENIED = "joins,queries,observations,future,telemetry,tokens"
"""Attacks that speak for others: for bodies, for robots, for those that never were."""
TO_INBOXES = "oversized,malformed,unfit,impostor,replay,stale"
"""Attacks with envelopes, which a robot may send to all."""
OUTSIDE_S = 2.0
"""A member is connected within milliseconds."""
ABOUT = re.compile(r"/(?:body|alive|state|event|activity|history|metadata|inbox)/([0-9a-f]{32})")
"""The robot in a key"""


@pytest.fixture(scope="module")
def besieged(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Besieged]:
    """A colony for all attacks; afterwards its ledger is exact."""
    with secured_siege(tmp_path_factory.mktemp("siege")) as made:
        yield Besieged(made, [made.monitor(2.0)])
        settle(made.made, made.view)
        made.made.stop_robots()
        check_ledger(made.made.stores)


def test_from_outside_there_is_no_link(besieged: Besieged, tmp_path: Path) -> None:
    """In plain text, without a certificate, with one of another authority: nothing is heard, and nothing arrives."""
    siege = besieged.siege
    endpoint, victim = siege.made.endpoint, siege.made.ids[0]
    stranger = Deployment(tmp_path / "stranger").member("robot", "insider", Identity(bytes(32)))
    member = siege.insider[1]
    plain = NetworkSettings(connect=(endpoint.replace("tls/", "tcp/"),))
    with (
        closing(open_session(plain)) as first,
        closing(open_session_without_certificate(endpoint, member)) as second,
        closing(open_lawless_session(endpoint, stranger)) as third,
        Spy(siege.session) as inside,
    ):
        outside = (first, second, third)
        heard = [Spy(session) for session in outside]
        leave = forged_leave(victim)
        end_s = time.monotonic() + OUTSIDE_S
        while time.monotonic() < end_s:
            for session in outside:
                session.put(ARENA.action(victim), b"forged")
                session.put(COLONY.inbox(victim), b"forged")
                session.get(ARENA.join(victim), lambda _: None, payload=leave)
            time.sleep(0.1)
        assert not [session for session in outside if has_links(session)]
        own = {(ARENA.action(victim), b"forged"), (COLONY.inbox(victim), b"forged")}
        own |= {(ARENA.join(victim), leave)}
        assert all(spy.heard <= own for spy in heard)
        assert inside.heard
        assert not inside.heard & own


def test_from_inside_nobody_speaks_for_another(besieged: Besieged) -> None:
    """No forged observation, request for a body, state, query or token reaches anybody, at 3,000 a second."""
    siege = besieged.siege
    made, robots = siege.made, siege.made.robots
    known = {robot.hex() for robot in made.ids}
    settle(made, siege.view)
    lines = [line_counts(robot.output) for robot in robots]
    with Spy(siege.session) as spy:
        _, before = besieged.withstands(DENIED)
    said = {key for key, _ in spy.heard}
    assert {name for key in said for name in ABOUT.findall(key)} == known
    for robot, earlier in zip(besieged.states(), before, strict=True):
        assert robot.faults == earlier.faults
        assert robot.tick < 2**50
    assert "hostile" not in {token.session for token in siege.view.all(Token)}
    assert [line_counts(robot.output) for robot in robots] == lines


def line_counts(output: str) -> list[int]:
    """Return how often a robot got a body, saw another go, and lost its links."""
    return [output.count(text) for text in ("has body", "is offline", "reconnecting")]


def test_no_forged_telemetry_is_shown(besieged: Besieged) -> None:
    """`crcolony status` shows the robots that there are, as they are, and no other."""
    siege = besieged.siege
    known = {robot.hex() for robot in siege.made.ids}
    wall = siege.insider[2].with_name("observer.wall")
    words = ("--json", "--connect", siege.made.endpoint, "--credentials", str(wall))
    with siege.attacked(DENIED):
        for attempt in range(3):  # in 1.5 s not every robot need be connected
            status = siege.made.start(f"status-{attempt}", "status", *words)
            assert status.wait(30.0) == 0
            shown = json.loads(status.output)["robots"]
            assert {one["id"] for one in shown} <= known
            assert all(one["tick"] < 2**50 and one["agent"] != "x" for one in shown)
            if {one["id"] for one in shown if one["alive"]} == known:
                return
    pytest.fail(f"not all are shown: {shown}")


def test_what_an_insider_may_send_to_inboxes_disturbs_no_robot(besieged: Besieged) -> None:
    """Envelopes too long, malformed, with invalid genes, old, or in another's name are refused, as from anybody."""
    besieged.refuses(TO_INBOXES)


def test_ten_thousand_envelopes_a_second_of_an_insider_delay_no_control_step(
    besieged: Besieged,
) -> None:
    """Of made-up robots, among replays: every one is checked against the insider's rights first."""
    besieged.withstands("flood")
