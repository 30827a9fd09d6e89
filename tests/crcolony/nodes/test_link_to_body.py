"""A robot asks one run of its arena at a time, lives in an arena that it knows, and believes nobody else."""

import secrets

import pytest

from crcolony.nodes.link_to_body import LinkToBody, UnknownArenaError
from crcolony.nodes.node_inputs import ColonyMember, FirstArenas
from crcolony.protocol.body_messages import BodyDenied, BodyGranted, Join
from crcolony.protocol.body_requests import open_request, sign_reply
from crcolony.protocol.codec import WireError
from crcolony.protocol.identity import Identity, seeded
from crcolony.protocol.link_keys import ExchangeKey
from crcolony.transport.interface import NoLinkOnThisMachine

ROBOT = seeded("test", 1, 0)
ARENA, IMPOSTOR = seeded("arena", 1, 0), seeded("arena", 1, 1)
KNOWN_RUN, OTHER_RUN = 7, 8


def new_link(known: FirstArenas | None = None) -> LinkToBody:
    member = ColonyMember(ROBOT, "blue", 0, 1)
    return LinkToBody(
        member,
        "lab",
        -1,
        known or FirstArenas(),
        secrets.token_bytes,
        lambda robot, action: None,
        NoLinkOnThisMachine(),
    )


def asked_run(link: LinkToBody) -> int:
    request = link.request()
    assert request is not None
    message = open_request(request).message
    assert isinstance(message, Join)
    return message.arena_run


def grant(link: LinkToBody, by: Identity, run: int | None = None) -> bytes:
    """Return a reply to the link's request, signed by an arena."""
    request = link.request()
    assert request is not None
    opened = open_request(request)
    key = ExchangeKey(secrets.token_bytes(32)).public
    run = opened.message.arena_run if run is None else run
    return sign_reply(BodyGranted(opened.digest, key, 0, run, 0, 0.1, False, "{}"), "lab", by)


def test_without_an_arena_there_is_nobody_to_ask() -> None:
    """Nor anything to leave."""
    link = new_link()
    assert link.request() is None
    assert link.leave() is None
    assert link.sense(b"noise") is None


def test_a_request_is_the_same_until_it_is_answered() -> None:
    """A denial is an answer: the next request is another one."""
    link = new_link()
    link.handle_online(KNOWN_RUN)
    first = link.request()
    assert first is not None
    assert link.request() == first
    denied = BodyDenied(open_request(first).digest, "full")
    assert link.open_reply(sign_reply(denied, "lab", ARENA)) == denied
    assert link.request() != first


def test_a_second_arena_of_its_name_is_refused() -> None:
    """The robot goes on to ask the one that it knows, and has no body of the other one."""
    link = new_link()
    link.handle_online(KNOWN_RUN)
    assert isinstance(link.open_reply(grant(link, ARENA)), BodyGranted)
    link.handle_offline(KNOWN_RUN)
    link.handle_online(OTHER_RUN)
    with pytest.raises(UnknownArenaError, match="another one of this name"):
        link.open_reply(grant(link, IMPOSTOR))
    assert link.open_reply(grant(link, IMPOSTOR)) is None, "it is said once"
    assert link.lease is None
    link.handle_online(KNOWN_RUN)
    assert asked_run(link) == KNOWN_RUN
    assert isinstance(link.open_reply(grant(link, ARENA)), BodyGranted)


def test_an_impostor_that_does_not_answer_delays_the_robot_for_a_moment() -> None:
    """After three requests in vain another run is asked, and so on in turn."""
    link = new_link()
    link.handle_online(KNOWN_RUN)
    link.handle_online(OTHER_RUN)
    runs = [asked_run(link) for _ in range(12)]
    assert runs == 2 * (3 * [OTHER_RUN] + 3 * [KNOWN_RUN])


def test_a_body_is_lost_with_its_own_run_alone() -> None:
    """Whatever other tokens come and go; while it has a body no other arena is asked."""
    link = new_link()
    assert link.handle_online(KNOWN_RUN)
    link.open_reply(grant(link, ARENA))
    assert not link.handle_online(OTHER_RUN)
    assert not link.handle_offline(OTHER_RUN)
    link.handle_online(OTHER_RUN)
    assert asked_run(link) == KNOWN_RUN
    assert link.handle_offline(KNOWN_RUN)
    assert link.lease is None


def test_runs_are_bounded() -> None:
    """Anybody may declare tokens."""
    link = new_link()
    for run in range(10_000):
        link.handle_online(run)
    assert len(link._runs) == 100


def test_a_grant_is_for_the_run_that_was_asked() -> None:
    """Another number in it is refused, also by the arena that it knows."""
    link = new_link()
    link.handle_online(KNOWN_RUN)
    with pytest.raises(WireError, match="another run"):
        link.open_reply(grant(link, ARENA, OTHER_RUN))
    assert link.lease is None


def test_a_reply_that_arrives_twice_has_no_effect() -> None:
    """Nor has one that nobody asked for."""
    link = new_link()
    link.handle_online(KNOWN_RUN)
    reply = grant(link, ARENA)
    assert link.open_reply(reply) is not None
    keys = link._keys
    assert link.open_reply(reply) is None
    assert link._keys == keys
