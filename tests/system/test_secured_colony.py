"""A deployment with certificates: nobody speaks for another, revoked members are out, and renewals disturb nobody."""

import datetime
import secrets
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import zenoh

from crcolony.body.contract import ACTION_WIDTH
from crcolony.protocol.body_messages import Action, pack_row
from crcolony.protocol.codec import encode
from crcolony.protocol.identity import Identity
from crcolony.protocol.key_expressions import ArenaKeys, ColonyKeys
from crcolony.protocol.telemetry_messages import Exchanged
from crcolony.transport.close_session import closing
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import has_links, open_session
from tests.support.deployment import Deployment
from tests.support.linked_robot import forged_join, forged_leave
from tests.support.mating_audit import check_ledger
from tests.support.observer import EventReceived, Token
from tests.support.process import wait_until
from tests.support.process_colony import settle
from tests.support.secured_colony import SecuredColony, secured_colony
from tests.support.spy import Spy

COLONY, ARENA = ColonyKeys("colony"), ArenaKeys("arena")


@pytest.fixture(scope="module")
def secured(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SecuredColony]:
    with secured_colony(tmp_path_factory.mktemp("secured")) as made:
        made.view.wait_for_matings(4)
        yield made


def test_only_a_member_is_connected(secured: SecuredColony, tmp_path: Path) -> None:
    """Not in plain text, without a certificate, with one of another authority, nor with one that has expired."""
    stranger = Deployment(tmp_path / "stranger").member("robot", "kitchen", Identity(bytes(32)))
    late = secured.deployment.member("observer", "late")
    secured.deployment.renew(late, datetime.timedelta(seconds=1.0))
    time.sleep(1.5)
    plain = secured.made.endpoint.replace("tls/", "tcp/")
    for network in (
        NetworkSettings(connect=(plain,)),
        NetworkSettings(connect=(secured.made.endpoint,), credentials=stranger),
        NetworkSettings(connect=(secured.made.endpoint,), credentials=late),
    ):
        with closing(open_session(network)) as session:
            time.sleep(1.0)
            assert not has_links(session), network
    genuine = NetworkSettings(connect=(secured.made.endpoint,), credentials=secured.operator)
    with closing(open_session(genuine)) as session:
        wait_until(lambda: has_links(session), "an operator is connected")


def test_a_link_ends_with_its_certificate(secured: SecuredColony) -> None:
    """Nobody renews it, as after a revocation: both sides close it, and it is not opened again."""
    credentials = secured.insider("observer", "fleeting")
    secured.deployment.renew(credentials, datetime.timedelta(seconds=5.0))
    expires_s = time.monotonic() + 5.0
    with closing(secured.open_lawless_session(credentials)) as session:
        wait_until(lambda: has_links(session), "it is connected", 4.0)
        wait_until(lambda: not has_links(session), "its links are closed", 10.0)
        assert time.monotonic() > expires_s - 1.5
        time.sleep(2.0)
        assert not has_links(session)


def put(session: zenoh.Session, key: str, data: bytes) -> object:
    return session.put(key, data)


def ask(session: zenoh.Session, key: str, data: bytes) -> object:
    return list(session.get(key, payload=data, timeout=0.3))


def declare(session: zenoh.Session, key: str, _: bytes) -> object:
    return session.liveliness().declare_token(key)


def reply_nothing(query: zenoh.Query) -> None:
    with query:
        pass


Use = Callable[[zenoh.Session, str, bytes], object]


def attacks(victim: bytes) -> dict[str, tuple[Use, str, bytes]]:
    """Return by name what a robot of the colony could do to another: how, the key, and what it says."""
    action = encode(Action(2**40, pack_row(np.ones(ACTION_WIDTH))))
    leave, join = forged_leave(victim), forged_join(victim, "other", -1, 0)
    return {
        "steer": (put, ARENA.action(victim), action),
        "steer all": (put, ARENA.all_actions, action),
        "observe for": (put, ARENA.observation(victim), b"forged"),
        "evict": (ask, ARENA.join(victim), leave),
        "take its body": (ask, ARENA.join(victim), join),
        "evict under a wildcard": (ask, ARENA.all_joins, leave),
        "silence": (declare, COLONY.alive(victim, 2**32 - 1, "f00d"), b""),
        "another arena": (declare, ARENA.alive(7, "f00d"), b""),
        "forge a state": (put, COLONY.state(victim), b"forged"),
        "forge an event": (put, COLONY.event(victim), b"forged"),
        "forge a scene": (put, ARENA.scene, b"forged"),
        "press the emergency stop": (ask, ARENA.stop, b"forged"),
    }


def test_a_robot_speaks_under_its_own_id_alone(secured: SecuredColony) -> None:
    """What it says in its own name arrives; nothing of another's body, tokens or telemetry, nor of an arena's."""
    me = Identity(bytes([9]) * 32)
    insider = secured.deployment.member("robot", "insider", me)
    spying = secured.insider("router", "spy")
    made, victim = secured.made, secured.made.ids[0]
    bodies = [robot.output.count("has body") for robot in made.robots]
    own = {
        (key, b"own") for key in (COLONY.state(me.id), ARENA.action(me.id), COLONY.inbox(victim))
    }
    overheard: list[zenoh.Sample] = []
    with (
        closing(secured.open_session(spying)) as listening,
        closing(secured.open_lawless_session(insider)) as session,
    ):
        spy = Spy(listening)
        held: list[object] = [
            session.declare_subscriber(key, overheard.append, allowed_origin=zenoh.Locality.REMOTE)
            for robot in made.ids
            for key in (COLONY.inbox(robot), ARENA.observation(robot))
        ]
        held.append(session.declare_queryable(ARENA.metadata, reply_nothing))

        def is_heard() -> bool:
            for use, key, data in attacks(victim).values():
                held.append(use(session, key, data))
            for key, data in own:
                session.put(key, data)
            return own <= spy.heard

        wait_until(is_heard, "what it says in its own name is heard")
        secured.view.wait_for_matings(4)
        forged = {(key, data) for _, key, data in attacks(victim).values()}
        assert not forged & spy.heard
        assert not overheard
    assert [robot.output.count("has body") for robot in made.robots] == bodies


def new_name(name: str) -> str:
    """Return a name that nobody has had: one that was revoked, when a test ran before, is never given again."""
    return f"{name}-{time.time_ns()}"


def test_a_revoked_robot_mates_with_nobody_after_a_second(secured: SecuredColony) -> None:
    """Counted from when the first knows of it; the others mate on, and its token is gone soon after."""
    name = new_name("doomed")
    folder, credentials = secured.deployment.robot(name)
    secured.publish()
    doomed = secured.start_robot(folder, credentials)
    doomed.wait_for("mated with", count=2)
    first_line = len(secured.view.update().lines)
    revoked = secured.operate("revoke", name)
    assert revoked.wait(1.0) == 0, revoked.output
    secured.view.wait_for_matings(10)
    wait_until(lambda: not secured.view.is_alive(doomed.id), "its token is gone", 15.0)
    first_known_s = min((folder / "roster").stat().st_mtime for folder in secured.credentials)
    first_known_s += time.monotonic() - time.time()
    matings = [
        (line.at_s, line.message.event.encounter)
        for line in secured.view.all(EventReceived, first_line)
        if isinstance(line.message.event, Exchanged)
    ]
    late = [encounter for at_s, encounter in matings if at_s > first_known_s + 1.0]
    assert late
    assert not [one for one in late if doomed.id in (one.initiator, one.responder)]
    doomed.stop()
    secured.departed.append(doomed.store)
    secured.made.robots.remove(doomed)


def test_a_robot_that_was_away_learns_of_a_revocation_when_it_is_back(
    secured: SecuredColony,
) -> None:
    """Its folder had the old roster; soon after its connection it has the new one."""
    away, lost = secured.made.robots[0], new_name("lost")
    roster = secured.credentials[0] / "roster"
    newest = secured.deployment.authority.folder / "roster"
    away.stop()
    secured.deployment.member("robot", lost, Identity(secrets.token_bytes(32)))
    secured.operate("revoke", lost)
    assert roster.read_bytes() != newest.read_bytes()
    away.start()
    away.wait_for("has body")
    wait_until(lambda: roster.read_bytes() == newest.read_bytes(), "it has the roster", 10.0)
    settle(secured.made, secured.view)


def test_renewals_disturb_nobody(secured: SecuredColony) -> None:
    """Robots and arena open other sessions while they mate: nobody is offline for a moment, and no body is lost."""
    made = secured.made
    settle(made, secured.view)
    first_line = len(secured.view.update().lines)
    bodies = [robot.output.count("has body") for robot in made.robots]
    for credentials in (*secured.credentials[:3], secured.arena_credentials):
        secured.deployment.renew(credentials)

    def sessions() -> set[tuple[str, str]]:
        tokens = secured.view.all(Token, first_line)
        return {(token.robot, token.session) for token in tokens if token.is_online}

    # One more session of every robot, and two of the arena, which has a fixed port.
    wait_until(lambda: len(sessions()) >= len(made.robots) + 2, "all have other sessions")
    secured.view.wait_for_matings(6)
    online: dict[str, set[str]] = {}
    for token in secured.view.all(Token):
        now = online.setdefault(token.robot, set())
        (now.add if token.is_online else now.discard)(token.session)
        if token in secured.view.all(Token, first_line):
            assert now, "offline for a moment"
    assert [robot.output.count("has body") for robot in made.robots] == bodies


def test_every_mating_has_both_sides_in_the_end(secured: SecuredColony) -> None:
    """Whatever was revoked and renewed before; with a revoked robot one may stay in doubt."""
    settle(secured.made, secured.view)
    secured.made.stop_robots()
    stores = [*secured.made.stores, *secured.departed]
    assert check_ledger(stores, is_settled=False).matings > 0
