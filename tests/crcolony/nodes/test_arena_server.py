"""An arena takes in whom it has room for, hears whom it knows, and keeps nothing for those who do not come back."""

import msgspec
import numpy as np
import pytest

from crcolony.body.contract import ACTION_WIDTH
from crcolony.body.settings import CyberRodent
from crcolony.nodes.arena_node import ArenaNode
from crcolony.nodes.arena_server import ArenaServer
from crcolony.protocol.body_messages import (
    Action,
    BodyDenied,
    BodyGranted,
    Join,
    Leave,
    decode_join_reply,
    pack_row,
)
from crcolony.protocol.codec import Message, encode
from crcolony.protocol.identity import RobotId, seeded
from crcolony.protocol.telemetry_messages import decode_arena_metadata
from crcolony.transport.interface import ActionReceived, QueryReceived, RobotOffline, RobotOnline
from crcolony.world.settings import ArenaSettings
from tests.support.small_colony import small

IDS = [seeded("test", 1, number).id for number in range(8)]
GRACE_S = 30.0


class Desk:
    """A reception, and what it said."""

    def __init__(self) -> None:
        self.node = ArenaNode(small(), 7, lockstep=False, body_grace_s=GRACE_S)
        self.said: list[str] = []
        self.forgotten: list[RobotId] = []
        self.reception = ArenaServer(self.node, self.forgotten.append, self.said.append, "lab")

    def ask(self, now_s: float, request: Message | bytes) -> list[BodyGranted | BodyDenied]:
        answers: list[bytes] = []
        request = request if isinstance(request, bytes) else encode(request)
        self.reception.handle_event(now_s, QueryReceived("join", b"", request, answers.append))
        return [decode_join_reply(answer) for answer in answers]

    def ask_about(self, now_s: float, request: bytes = b"") -> list[bytes]:
        answers: list[bytes] = []
        self.reception.handle_event(now_s, QueryReceived("metadata", b"", request, answers.append))
        return answers

    def see(self, robot: int, session: str = "a") -> None:
        self.reception.handle_event(0.0, RobotOnline(IDS[robot], 1, session))

    def lose(self, now_s: float, robot: int, session: str = "a") -> None:
        self.reception.handle_event(now_s, RobotOffline(IDS[robot], 1, session))

    def act(self, robot: int, data: bytes) -> None:
        self.reception.handle_event(0.0, ActionReceived(IDS[robot], data))


@pytest.fixture
def desk() -> Desk:
    return Desk()


def test_who_asks_gets_a_body_while_there_is_room(desk: Desk) -> None:
    """And then the reason why not, which a person is told once for each robot."""
    for robot in range(4):
        (answer,) = desk.ask(10.0, Join(IDS[robot], "test", robot))
        assert isinstance(answer, BodyGranted)
    for _ in range(3):
        (answer,) = desk.ask(11.0, Join(IDS[5], "test", -1))
        assert answer == BodyDenied("full: all 4 places are taken")
    assert len([line for line in desk.said if "gets no place" in line]) == 1
    assert len([line for line in desk.said if "gets place" in line]) == 4


def test_who_leaves_makes_room(desk: Desk) -> None:
    """And nothing is kept for it; who has no body cannot leave."""
    for robot in range(4):
        desk.ask(0.0, Join(IDS[robot], "test", robot))
    assert not desk.ask(1.0, Leave(IDS[2]))
    assert not desk.ask(1.0, Leave(IDS[5]))
    assert desk.forgotten == [IDS[2]]
    (answer,) = desk.ask(2.0, Join(IDS[5], "test", -1))
    assert isinstance(answer, BodyGranted)
    assert answer.slot == 2


def test_a_body_outlives_its_robot_for_a_while(desk: Desk) -> None:
    """It is kept for who comes back in time, and removed after that; one of two sessions is enough to be there."""
    for robot in (0, 1, 2):
        desk.see(robot)
        desk.ask(0.0, Join(IDS[robot], "test", robot))
    desk.see(2, "b")
    for robot in (0, 1, 2):
        desk.lose(1.0, robot)
    desk.see(1, "c")
    desk.reception.remove_absent(GRACE_S)
    assert len(desk.node.robots) == 3
    desk.reception.remove_absent(1.0 + GRACE_S)
    assert set(desk.node.robots) == {IDS[1], IDS[2]}
    assert desk.forgotten == [IDS[0]]


def test_who_asks_and_is_not_on_the_network_is_waited_for_so_long(desk: Desk) -> None:
    """So that made-up robots do not keep their places."""
    desk.ask(0.0, Join(IDS[0], "test", -1))
    desk.reception.remove_absent(GRACE_S)
    assert not desk.node.robots


def test_an_action_moves_the_body_of_who_sent_it(desk: Desk) -> None:
    """What is no action, and one of a robot without a body, are counted."""
    desk.see(0)
    desk.ask(0.0, Join(IDS[0], "test", 0))
    desk.node.step()
    action = encode(Action(1, pack_row(np.zeros(ACTION_WIDTH))))
    assert desk.node.waiting_for == [IDS[0]]
    desk.act(0, action)
    assert not desk.node.waiting_for
    desk.act(0, b"noise")
    desk.act(5, action)
    assert desk.node.counts == {"malformed": 1, "unknown": 1}


def test_who_asks_what_the_arena_is_like_is_told(desk: Desk) -> None:
    """Its settings, and which run of it this is; a question that says anything is malformed."""
    (answer,) = desk.ask_about(10.0)
    about = decode_arena_metadata(answer)
    assert (about.arena, about.arena_run) == ("lab", 7)
    message = msgspec.json.decode(about.settings)
    assert set(message) == {"arena", "body"}
    assert msgspec.convert(message["arena"], ArenaSettings) == small().arena
    assert msgspec.convert(message["body"], CyberRodent) == small().body
    assert not desk.ask_about(10.0, b"?")
    assert desk.node.counts == {"malformed": 1}


def test_an_arena_answers_a_hundred_questions_a_second(desk: Desk) -> None:
    """Those that are too many are counted."""
    answers = [desk.ask_about(10.0 + k / 1000.0) for k in range(1000)]
    assert 100 <= sum(map(len, answers)) <= 200
    assert desk.node.counts["too many"] == 1000 - sum(map(len, answers))


def test_noise_is_no_request_and_fills_no_log(desk: Desk) -> None:
    """A thousand at once are counted; a hundred lines are said."""
    desk.reception.handle_event(10.0, RobotOnline(IDS[0], 1, "a"))
    for _ in range(1000):
        assert not desk.ask(10.0, b"noise")
    assert desk.node.counts["malformed"] == 1000
    assert len(desk.said) <= 100
