"""An arena grants bodies while it has room, applies the actions of its robots, and removes those that do not return."""

import msgspec
import numpy as np
import pytest

from crcolony.body.contract import ACTION_WIDTH
from crcolony.body.settings import CyberRodent
from crcolony.body_server.body_server import BodyServer
from crcolony.nodes.arena_node import ArenaNode
from crcolony.protocol.body_messages import (
    Action,
    BodyDenied,
    BodyGranted,
    pack_row,
)
from crcolony.protocol.codec import encode
from crcolony.protocol.identity import RobotId, seeded
from crcolony.protocol.link_keys import seal
from crcolony.protocol.signed_telemetry import open_telemetry, purpose_of_arena
from crcolony.protocol.telemetry_messages import decode_arena_metadata
from crcolony.transport.interface import ActionReceived, QueryReceived, RobotOffline, RobotOnline
from crcolony.world.settings import ArenaSettings
from tests.support.linked_robot import LinkedRobot, forged_join, forged_leave
from tests.support.small_colony import small

KEYS = [seeded("test", 1, number) for number in range(8)]
IDS = [key.id for key in KEYS]
ARENA_KEY = seeded("arena", 1, 0)
ARENA_RUN = 7
GRACE_S = 30.0


class Setup:
    """An arena server, with what it printed and which robots left."""

    def __init__(self) -> None:
        self.node = ArenaNode(small(), ARENA_RUN, lockstep=False, body_grace_s=GRACE_S)
        self.lines: list[str] = []
        self.left: list[RobotId] = []
        self.server = BodyServer(self.node, ARENA_KEY, self.left.append, self.lines.append, "lab")
        self.robots = [LinkedRobot(key, "lab", ARENA_RUN) for key in KEYS]

    def request(self, now_s: float, under: int, request: bytes) -> list[bytes]:
        """Send a request under the key of a robot; return the replies."""
        replies: list[bytes] = []
        query = QueryReceived("join", IDS[under], request, replies.append)
        self.server.handle_event(now_s, query)
        return replies

    def join(self, now_s: float, robot: int) -> BodyGranted | BodyDenied:
        """Let a robot ask for a body."""
        end = self.robots[robot]
        (reply,) = self.request(now_s, robot, end.request())
        return end.reply(reply)

    def query_metadata(self, now_s: float, request: bytes = b"") -> list[bytes]:
        replies: list[bytes] = []
        self.server.handle_event(now_s, QueryReceived("metadata", b"", request, replies.append))
        return replies

    def appear(self, robot: int, session: str = "a") -> None:
        self.server.handle_event(0.0, RobotOnline(IDS[robot], 1, session))

    def disappear(self, now_s: float, robot: int, session: str = "a") -> None:
        self.server.handle_event(now_s, RobotOffline(IDS[robot], 1, session))

    def act(self, robot: int, data: bytes) -> None:
        self.server.handle_event(0.0, ActionReceived(IDS[robot], data))


@pytest.fixture
def setup() -> Setup:
    return Setup()


def test_a_robot_that_joins_gets_a_body_while_there_is_room(setup: Setup) -> None:
    """Afterwards it receives the reason why not, which is printed once for each robot."""
    for robot in range(4):
        assert isinstance(setup.join(10.0, robot), BodyGranted)
    for _ in range(3):
        reply = setup.join(11.0, 5)
        assert isinstance(reply, BodyDenied)
        assert reply.reason == "full: all 4 slots are taken"
    assert len([line for line in setup.lines if "gets no slot" in line]) == 1
    assert len([line for line in setup.lines if "gets slot" in line]) == 4


def test_nobody_asks_in_the_name_of_another_robot(setup: Setup) -> None:
    """A request is of who signed it, and under that robot's key alone: a deployment lets nobody else use it."""
    setup.join(1.0, 0)
    assert not setup.request(1.0, 1, setup.robots[0].leave())
    assert not setup.request(1.0, 1, setup.robots[2].request())
    assert not setup.request(1.0, 0, forged_leave(IDS[0], ARENA_RUN))
    assert not setup.request(1.0, 2, forged_join(IDS[2], "test", -1, ARENA_RUN))
    assert list(setup.node.robots) == [IDS[0]]
    assert setup.node.counts["malformed"] == 4


def test_a_robot_that_leaves_frees_its_slot(setup: Setup) -> None:
    """Nothing is kept for it; a robot without a body cannot leave."""
    for robot in range(4):
        setup.join(1.0, robot)
    assert not setup.request(1.0, 2, setup.robots[2].leave())
    assert not setup.request(1.0, 5, setup.robots[5].leave())
    assert setup.left == [IDS[2]]
    reply = setup.join(2.0, 6)
    assert isinstance(reply, BodyGranted)
    assert reply.slot == 2


def test_a_body_is_kept_for_a_robot_that_is_offline_for_a_while(setup: Setup) -> None:
    """It is removed if the robot does not return in time; one of two sessions is enough to be online."""
    for robot in (0, 1, 2):
        setup.appear(robot)
        setup.join(1.0, robot)
    setup.appear(2, "b")
    for robot in (0, 1, 2):
        setup.disappear(1.0, robot)
    setup.appear(1, "c")
    setup.server.remove_absent(GRACE_S)
    assert len(setup.node.robots) == 3
    setup.server.remove_absent(1.0 + GRACE_S)
    assert set(setup.node.robots) == {IDS[1], IDS[2]}
    assert setup.left == [IDS[0]]


def test_the_body_of_a_robot_that_never_comes_online_is_removed(setup: Setup) -> None:
    """So that made-up robots do not keep their slots."""
    setup.join(1.0, 0)
    setup.server.remove_absent(1.0 + GRACE_S)
    assert not setup.node.robots


def test_an_action_is_applied_to_the_body_of_its_robot(setup: Setup) -> None:
    """Invalid actions, and those of robots without a body, are counted."""
    setup.appear(0)
    setup.join(1.0, 0)
    setup.node.step()
    action = Action(1, pack_row(np.zeros(ACTION_WIDTH)))
    assert setup.node.waiting_for == [IDS[0]]
    setup.act(0, encode(action))
    setup.act(0, setup.robots[0].seal(action)[:-1])
    setup.act(0, b"noise")
    setup.act(5, seal(bytes(32), encode(action)))
    assert setup.node.waiting_for == [IDS[0]]
    setup.act(0, setup.robots[0].seal(action))
    assert not setup.node.waiting_for
    assert setup.node.counts == {"forged": 4}
    setup.act(0, seal(setup.robots[0].keys.actions, b"noise"))
    assert setup.node.counts["malformed"] == 1


def test_a_metadata_query_is_answered_with_the_settings(setup: Setup) -> None:
    """And with the name and the run of the arena; a query with a payload is malformed."""
    (reply,) = setup.query_metadata(10.0)
    telemetry = open_telemetry(reply)
    assert telemetry.key == ARENA_KEY.public_key
    assert telemetry.is_valid(purpose_of_arena("lab"))
    metadata = decode_arena_metadata(telemetry.content)
    assert (metadata.arena, metadata.arena_run) == ("lab", 7)
    settings = msgspec.json.decode(metadata.settings)
    assert set(settings) == {"arena", "body"}
    assert msgspec.convert(settings["arena"], ArenaSettings) == small().arena
    assert msgspec.convert(settings["body"], CyberRodent) == small().body
    assert not setup.query_metadata(10.0, b"?")
    assert setup.node.counts == {"malformed": 1}


def test_an_arena_answers_a_hundred_queries_a_second(setup: Setup) -> None:
    """Those above the limit are counted."""
    replies = [setup.query_metadata(10.0 + k / 1000.0) for k in range(1000)]
    assert 100 <= sum(map(len, replies)) <= 200
    assert setup.node.counts["too many"] == 1000 - sum(map(len, replies))


def test_malformed_requests_are_counted_and_fill_no_log(setup: Setup) -> None:
    """A thousand at once are counted; at most a hundred lines are printed."""
    setup.server.handle_event(10.0, RobotOnline(IDS[0], 1, "a"))
    for _ in range(1000):
        assert not setup.request(10.0, 0, b"noise")
    assert setup.node.counts["malformed"] == 1000
    assert len(setup.lines) <= 100
