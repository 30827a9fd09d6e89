"""An arena carries every request out once, in its order, and speaks to each robot with keys of its own."""

import itertools
import secrets

import pytest
from hypothesis import given
from hypothesis import strategies as st

from crcolony.body_server.body_links import BodyLinks, StaleRequestError
from crcolony.protocol.body_messages import BodyGranted
from crcolony.protocol.body_requests import Request
from crcolony.protocol.codec import WireError
from crcolony.protocol.identity import seeded
from crcolony.protocol.link_keys import open_sealed, seal
from tests.support.linked_robot import LinkedRobot, forged_join

RUN, ARENA_KEY = 7, seeded("arena", 1, 0)
ROBOT = seeded("test", 1, 0)
LATE_S = 100.0


def links(run: int = RUN) -> BodyLinks:
    return BodyLinks("lab", run, ARENA_KEY, secrets.token_bytes)


def robot(run: int = RUN) -> LinkedRobot:
    return LinkedRobot(ROBOT, "lab", run)


def grant(server: BodyLinks, end: LinkedRobot) -> bytes:
    """Let a robot ask, and grant it a body; return the reply."""
    request = server.receive(LATE_S, end.id, end.request())
    assert isinstance(request, Request)
    return server.grant(
        request, lambda digest, key: BodyGranted(digest, key, 0, RUN, 0, 0.1, False, "{}")
    )


def test_both_ends_understand_each_other() -> None:
    """Observations one way, actions the other way; neither can be sent back."""
    server, end = links(), robot()
    end.reply(grant(server, end))
    observation = server.seal_observation(end.id, b"seen")
    assert observation is not None
    assert open_sealed(end.keys.observations, observation) == b"seen"
    assert server.open_action(end.id, seal(end.keys.actions, b"done")) == b"done"
    with pytest.raises(WireError):
        server.open_action(end.id, observation)


def test_a_request_that_arrives_again_gets_the_same_reply() -> None:
    """Since the first reply may be lost; the keys stay."""
    server, end = links(), robot()
    request = end.request()
    reply = grant(server, end)
    assert server.receive(LATE_S, end.id, request) == reply
    end.reply(reply)
    assert server.open_action(end.id, seal(end.keys.actions, b"done")) == b"done"


def test_a_request_is_never_carried_out_again() -> None:
    """Neither after a later one nor after the robot has left, whoever sends it."""
    server, end = links(), robot()
    first = end.request()
    end.reply(grant(server, end))
    second = end.request()
    end.reply(grant(server, end))
    with pytest.raises(StaleRequestError):
        server.receive(LATE_S, end.id, first)
    server.remove(end.id)
    for old in (first, second):
        with pytest.raises(StaleRequestError):
            server.receive(LATE_S, end.id, old)
    assert server.seal_observation(end.id, b"seen") is None


def test_a_robot_without_a_link_is_told_nothing() -> None:
    """And nothing that it does counts."""
    server = links()
    assert server.seal_observation(ROBOT.id, b"seen") is None
    with pytest.raises(WireError, match="of no link"):
        server.open_action(ROBOT.id, bytes(99))


def test_requests_for_another_run_and_forged_ones_are_refused() -> None:
    """A run that has ended can be asked nothing; a signature must be the robot's."""
    server = links(run=8)
    with pytest.raises(StaleRequestError, match="another run"):
        server.receive(LATE_S, ROBOT.id, robot(RUN).request())
    with pytest.raises(WireError, match="not the robot's"):
        server.receive(LATE_S, ROBOT.id, forged_join(ROBOT.id, "test", -1, 8))
    wrong = LinkedRobot(ROBOT, "another arena", 8)
    with pytest.raises(WireError, match="signature is not valid"):
        server.receive(LATE_S, ROBOT.id, wrong.request())


def test_a_denied_robot_keeps_the_body_that_it_has() -> None:
    """It asked in the name of another colony: its link goes on."""
    server, end = links(), robot()
    end.reply(grant(server, end))
    again = LinkedRobot(ROBOT, "lab", RUN, "another")
    again.link._count = 10
    request = server.receive(LATE_S, again.id, again.request())
    assert isinstance(request, Request)
    server.deny(request, "in use")
    assert server.open_action(end.id, seal(end.keys.actions, b"done")) == b"done"


def test_strangers_cost_little() -> None:
    """At most 200 of their signatures are verified in a second; robots with a body have a share of their own."""
    server, end = links(), robot()
    end.reply(grant(server, end))
    strangers = (LinkedRobot(seeded("strange", 1, n), "lab", RUN) for n in itertools.count())
    received = [
        server.receive(LATE_S, one.id, one.request()) for one in itertools.islice(strangers, 400)
    ]
    assert sum(one is not None for one in received) <= 200
    assert isinstance(server.receive(LATE_S, end.id, end.request()), Request)


@given(st.lists(st.sampled_from(["ask", "again", "replay", "leave", "remove"]), max_size=30))
def test_whatever_is_replayed_the_last_link_holds(steps: list[str]) -> None:
    """After any history a robot that has a body is understood, and one without has no link."""
    server, end = links(), robot()
    said: list[bytes] = []
    for now_s, step in enumerate(steps, 100):
        if step == "ask":
            data = end.request()
            said.append(data)
            request = server.receive(float(now_s), end.id, data)
            assert isinstance(request, Request)
            end.reply(
                server.grant(request, lambda d, k: BodyGranted(d, k, 0, RUN, 0, 0.1, False, "{}"))
            )
        elif step in ("again", "replay") and said:
            data = said[-1] if step == "again" else said[0]
            try:
                received = server.receive(float(now_s), end.id, data)
            except StaleRequestError:
                continue
            assert isinstance(received, bytes)
        elif step == "leave" and (leaving := end.link.leave()):
            request = server.receive(float(now_s), end.id, leaving)
            assert isinstance(request, Request)
            server.leave(request)
        elif step == "remove":
            server.remove(end.id)
            end.link.lease = None
    if end.link.lease is None:
        assert server.seal_observation(end.id, b"seen") is None
    else:
        assert server.open_action(end.id, seal(end.keys.actions, b"done")) == b"done"
