"""Robots of one process are there for all that ask, each under its own key."""

from collections.abc import Iterator

import pytest
import zenoh

from crcolony.protocol.key_expressions import ColonyKeys
from crcolony.transport.interface import InboundEvent, QueryReceived
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_robots import RobotTransport
from crcolony.transport.zenoh_session import free_port, has_links, open_session
from tests.support.process import wait_until

ROBOTS = [bytes([number]) * 16 for number in range(3)]


def answer(event: InboundEvent) -> None:
    """Reply with the robot's id."""
    if isinstance(event, QueryReceived):
        event.reply(event.robot)


@pytest.fixture
def observer() -> Iterator[zenoh.Session]:
    """A peer of three robots that answer."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    session = open_session(NetworkSettings(listen=(endpoint,)))
    transport = RobotTransport(session, "colony", "arena", answer)
    for robot in ROBOTS:
        transport.add_robot(robot, 1)
    asking = open_session(NetworkSettings(connect=(endpoint,)))
    wait_until(lambda: has_links(asking), "a link")
    yield asking
    for one in (asking, session):
        one.close()  # type: ignore[no-untyped-call]


@pytest.mark.parametrize("topic", ["metadata", "history"])
def test_a_query_of_a_pattern_is_answered_by_every_robot(
    observer: zenoh.Session, topic: str
) -> None:
    """Once each: Zenoh keeps one reply of those under one key, unless it is told otherwise."""
    keys = ColonyKeys("colony")

    def answers() -> dict[str, bytes]:
        replies = observer.get(f"crcolony/1/colony/colony/{topic}/*", payload=b"x", timeout=5.0)
        kept = [reply.ok for reply in replies if reply.ok is not None]
        return {str(sample.key_expr): sample.payload.to_bytes() for sample in kept}

    key_of = {"metadata": keys.metadata, "history": keys.history}[topic]
    expected = {key_of(robot): robot for robot in ROBOTS}
    wait_until(lambda: answers() == expected, "every robot answers", 20.0)
