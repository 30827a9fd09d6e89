"""A robot finds a body, lives with it, and is not put off by silence, lies, or a link that is lost."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal

import msgspec
import numpy as np
import pytest

from crcolony.body.contract import OBSERVATION_WIDTH
from crcolony.body.settings import CyberRodent
from crcolony.nodes.embodied_robot import DuplicateIdentityError, EmbodiedRobot
from crcolony.nodes.robot_node import RobotNode
from crcolony.protocol.body_messages import (
    Action,
    BodyDenied,
    BodyGranted,
    Contact,
    Join,
    Leave,
    Observation,
    decode_action,
    decode_join,
    pack_row,
)
from crcolony.protocol.codec import encode
from crcolony.protocol.identity import RobotId, seeded
from crcolony.protocol.telemetry_messages import (
    MAX_REPORTED_PEERS,
    HistoryRequest,
    RobotMetadata,
    Scene,
    SceneRobot,
    decode_history_reply,
    decode_robot_metadata,
)
from crcolony.robot.factory import make_robots, own_streams
from crcolony.robot.state import SLICE_OVER
from crcolony.storage.store import RobotStore
from crcolony.transport.interface import (
    ArenaOffline,
    ArenaOnline,
    IncompatiblePeer,
    JoinReplyReceived,
    ObservationReceived,
    QueryReceived,
    RobotOffline,
    RobotOnline,
    SceneReceived,
)
from tests.support.small_colony import small

COLONY, ARENA_RUN = "blue", 7
ME, PEER = sorted((seeded(COLONY, 1, k) for k in range(2)), key=lambda key: key.id)
BODY = msgspec.json.encode(CyberRodent()).decode()
CALM = pack_row(np.zeros(OBSERVATION_WIDTH))


class Air:
    """What a robot says, kept."""

    def __init__(self) -> None:
        self.requests: list[Join | Leave] = []
        self.actions: list[Action] = []
        self.is_searching = False

    def send_envelope(self, to: RobotId, envelope: bytes) -> None: ...

    def request_body(self, robot: RobotId, request: bytes) -> None:
        self.requests.append(decode_join(request))

    def publish_action(self, robot: RobotId, action: bytes) -> None:
        self.actions.append(decode_action(action))

    def publish_telemetry(
        self, robot: RobotId, topic: Literal["state", "event"], data: bytes
    ) -> None: ...

    def subscribe_scene(self, is_searching: bool) -> None:
        self.is_searching = is_searching


class Scenery:
    """A robot, alone with a test."""

    def __init__(self, folder: Path) -> None:
        config = small()
        batch, _, (robot,) = make_robots(config, [ME.id.hex()], own_streams([ME.id]))
        schema = bytes.fromhex(robot.subpopulation.schema.digest)
        self.store = RobotStore(folder / "robot.sqlite", ME.id, schema, durable=False)
        self.air = Air()
        self.said: list[str] = []
        self.came_anew = 0
        self.batch, self.unix_s = batch, 1_000.0
        node = RobotNode(
            ME, COLONY, 0, robot, batch, self.store, self.store.begin_incarnation(5), self.air,
            unix_s=lambda: self.unix_s,
        )  # fmt: skip
        node.session = "mine"
        self.robot = EmbodiedRobot(
            node, self.air, config, "here", -1, 10.0, self._reconnect_session, self.said.append
        )
        self.robot.start(0.0)

    def _reconnect_session(self) -> None:
        self.came_anew += 1

    def slot(
        self, now_s: float, tick: int = 0, lockstep: bool = False, arena_run: int = ARENA_RUN
    ) -> None:
        answer = encode(BodyGranted(2, arena_run, tick, 0.1, lockstep, BODY))
        self.robot.handle_event(now_s, JoinReplyReceived(ME.id, answer))

    def observe(
        self,
        now_s: float,
        tick: int,
        arena_run: int = ARENA_RUN,
        row: bytes = CALM,
        contact: Contact | None = None,
    ) -> None:
        seen = encode(Observation(arena_run, tick, row, contact))
        self.robot.handle_event(now_s, ObservationReceived(ME.id, seen))

    def show(self, now_s: float, is_lit: bool) -> None:
        seen = SceneRobot(PEER.id, COLONY, 0.0, 0.0, 0.0, False, float(is_lit), 0.0, 0.0, False)
        scene = Scene("here", ARENA_RUN, 1, 1, 0, 0.1, 1.0, 1.0, [seen], [])
        self.robot.handle_event(now_s, SceneReceived(encode(scene)))

    def ask(self, about: Literal["history", "metadata"], request: bytes) -> list[bytes]:
        answers: list[bytes] = []
        self.robot.handle_event(0.0, QueryReceived(about, ME.id, request, answers.append))
        return answers

    def capture(self, *captures: int) -> None:
        """Let the robot's agents have captured so many batteries in their lives."""
        self.batch.captures[0] = captures

    def turn_over(self) -> None:
        """End the last slice of a generation."""
        node = self.robot.node
        generation = node.robot.generation
        while node.robot.generation == generation:
            self.batch.events[0] = SLICE_OVER
            node.advance_slice()

    @property
    def acted(self) -> list[int]:
        """The ticks it has answered."""
        return [action.tick for action in self.air.actions]


@pytest.fixture
def scenery(tmp_path: Path) -> Iterator[Scenery]:
    made = Scenery(tmp_path)
    yield made
    made.store.close()


class TestTheBody:
    def test_it_asks_for_a_body_until_it_has_one(self, scenery: Scenery) -> None:
        """As soon as it lives, when an arena appears, and every second."""
        scenery.robot.handle_timers(0.0)
        scenery.robot.handle_event(0.1, ArenaOnline(ARENA_RUN))
        scenery.robot.handle_timers(0.2)
        scenery.robot.handle_timers(1.2)
        assert scenery.air.requests == [Join(ME.id, COLONY, -1)] * 3
        scenery.slot(1.3)
        scenery.robot.handle_timers(2.4)
        assert len(scenery.air.requests) == 3
        assert scenery.robot.has_body
        assert scenery.robot.node.number == 2

    def test_it_answers_every_observation_once(self, scenery: Scenery) -> None:
        """One that comes twice, late, or from another run of the arena is not answered."""
        scenery.slot(0.0)
        for tick in (1, 2, 2, 1, 3):
            scenery.observe(0.1 * tick, tick)
        scenery.observe(0.5, 4, arena_run=ARENA_RUN + 1)
        assert scenery.acted == [1, 2, 3]

    def test_in_lockstep_it_says_again_what_the_arena_did_not_hear(self, scenery: Scenery) -> None:
        """The same action, and nothing is lived twice."""
        scenery.slot(0.0, lockstep=True)
        scenery.observe(0.1, 1)
        steps = scenery.robot.node.robot.steps
        scenery.observe(0.6, 1)
        assert scenery.acted == [1, 1]
        assert scenery.air.actions[0] == scenery.air.actions[1]
        assert scenery.robot.node.robot.steps == steps

    def test_without_a_body_it_does_nothing(self, scenery: Scenery) -> None:
        """Nor after the arena has gone; another run of the arena is another body."""
        scenery.observe(0.0, 1)
        scenery.slot(0.1)
        scenery.robot.handle_event(0.2, ArenaOffline(ARENA_RUN + 1))
        scenery.observe(0.3, 2)
        scenery.robot.handle_event(0.4, ArenaOffline(ARENA_RUN))
        scenery.observe(0.5, 3)
        assert scenery.acted == [2]
        assert "the arena is gone; looking for arena here" in scenery.said
        scenery.slot(0.6, arena_run=ARENA_RUN + 1)
        scenery.observe(0.7, 1, arena_run=ARENA_RUN + 1)
        assert scenery.acted == [2, 1]

    def test_a_body_that_is_silent_is_asked_for_again(self, scenery: Scenery) -> None:
        """After 3 s, and an observation of a tick to come is forgotten then."""
        scenery.slot(0.0)
        scenery.observe(0.1, 2**40)
        scenery.observe(0.2, 2)
        assert scenery.acted == [2**40]
        scenery.robot.handle_timers(3.0)
        assert not scenery.air.requests
        scenery.robot.handle_timers(3.2)
        assert len(scenery.air.requests) == 1
        scenery.slot(3.3, tick=30)
        scenery.observe(3.4, 31)
        assert scenery.acted == [2**40, 31]

    @pytest.mark.parametrize("row", [pack_row(np.full(OBSERVATION_WIDTH, np.nan)), b"short"])
    def test_an_observation_that_is_none_is_counted(self, scenery: Scenery, row: bytes) -> None:
        """And nothing is done."""
        scenery.slot(0.0)
        scenery.observe(0.1, 1, row=row)
        assert not scenery.acted
        assert scenery.robot.node.faults["malformed observation"] == 1

    @pytest.mark.parametrize(
        ("answer", "said"),
        [
            (encode(BodyDenied("full: all 4 places are taken")), "no body: arena here is full"),
            (encode(BodyGranted(0, ARENA_RUN, 0, 0.1, False, "{")), "arena here: malformed answer"),
            (b"noise", "arena here: malformed answer"),
        ],
        ids=["full", "no settings", "noise"],
    )
    def test_it_says_why_it_has_no_body(self, scenery: Scenery, answer: bytes, said: str) -> None:
        """The arena is full, or says what nobody understands."""
        scenery.robot.handle_event(4.0, JoinReplyReceived(ME.id, answer))
        assert not scenery.robot.has_body
        assert any(line.startswith(said) for line in scenery.said)

    def test_it_gives_its_body_back(self, scenery: Scenery) -> None:
        """When it leaves."""
        scenery.robot.release_body()
        assert scenery.air.requests == [Leave(ME.id)]


class TestTheOthers:
    def test_who_is_met_and_cannot_be_seen_is_a_lost_link(self, scenery: Scenery) -> None:
        """After 5 s of meeting it comes onto the network anew, and not again for half a minute."""
        scenery.slot(0.0)
        for tick in range(1, 300):
            scenery.observe(0.1 * tick, tick, contact=Contact(PEER.id, tick))
        assert scenery.came_anew == 1
        for tick in range(300, 420):
            scenery.observe(0.1 * tick, tick, contact=Contact(PEER.id, tick))
        assert scenery.came_anew == 2

    def test_who_is_missed_with_its_lamp_lit_is_a_lost_link(self, scenery: Scenery) -> None:
        """A dark lamp proves nothing; and who comes anew sees nobody yet."""
        other = seeded(COLONY, 1, 3).id
        for robot in (PEER.id, other):
            scenery.robot.handle_event(0.0, RobotOnline(robot, 1, "theirs"))
        scenery.robot.handle_event(0.1, RobotOffline(PEER.id, 1, "theirs"))
        scenery.robot.handle_timers(0.2)
        assert scenery.air.is_searching
        scenery.show(4.0, is_lit=True)
        scenery.show(5.2, is_lit=False)
        assert scenery.came_anew == 0
        scenery.show(5.3, is_lit=True)
        assert scenery.came_anew == 1
        assert not scenery.robot.node.peers

    def test_who_is_back_is_missed_no_more(self, scenery: Scenery) -> None:
        """Nothing is done, and nobody is searched for."""
        scenery.robot.handle_event(0.0, RobotOffline(PEER.id, 1, "theirs"))
        scenery.robot.handle_event(1.0, RobotOnline(PEER.id, 2, "theirs"))
        scenery.show(9.0, is_lit=True)
        scenery.robot.handle_timers(9.0)
        assert scenery.came_anew == 0
        assert not scenery.air.is_searching

    def test_a_robot_of_another_version_is_told_of(self, scenery: Scenery) -> None:
        """And moves nobody."""
        scenery.robot.handle_event(0.0, IncompatiblePeer(PEER.id, 9))
        assert any("speaks version 9 of the protocol" in line for line in scenery.said)

    def test_a_twin_that_was_there_first_ends_it(self, scenery: Scenery) -> None:
        """It takes no body away from it, and stops once the other is surely alive."""
        scenery.robot.handle_event(0.0, RobotOnline(ME.id, 1, "older"))
        scenery.robot.handle_timers(1.0)
        scenery.robot.release_body()
        assert not scenery.air.requests
        with pytest.raises(DuplicateIdentityError, match="lives already in another process"):
            scenery.robot.handle_timers(7.5)

    def test_it_knows_when_it_has_something_to_do(self, scenery: Scenery) -> None:
        """`next_s` is never later than what is due, and never in the past once that is done."""
        now_s = 0.0
        for _ in range(100):
            scenery.robot.handle_timers(now_s)
            assert scenery.robot.next_s > now_s
            now_s = scenery.robot.next_s


class TestObservers:
    """Whoever asks is told, and costs it little."""

    def about(self, scenery: Scenery) -> RobotMetadata:
        (answer,) = scenery.ask("metadata", b"")
        return decode_robot_metadata(answer)

    def test_it_tells_what_it_is_like_and_whom_it_sees(self, scenery: Scenery) -> None:
        """Its body is the one that it has: the config's, and then what the arena gave it."""
        config = small()
        about = self.about(scenery)
        assert (about.robot, about.incarnation, about.peers) == (
            ME.id,
            scenery.robot.node.incarnation,
            [],
        )
        message = msgspec.json.decode(about.settings)
        assert set(message) == {"body", "learning", "life", "heredity"}
        for name, settings in message.items():
            assert msgspec.convert(settings, type(group := getattr(config, name))) == group
        scenery.robot.handle_event(0.0, RobotOnline(PEER.id, 1, "theirs"))
        body = msgspec.json.encode(CyberRodent(camera_range_m=0.75)).decode()
        scenery.robot.handle_event(
            0.0, JoinReplyReceived(ME.id, encode(BodyGranted(2, ARENA_RUN, 0, 0.1, False, body)))
        )
        about = self.about(scenery)
        assert about.peers == [PEER.id]
        assert msgspec.json.decode(about.settings)["body"]["camera_range_m"] == 0.75

    def test_of_many_peers_it_names_some(self, scenery: Scenery) -> None:
        """As many as a message holds."""
        for number in range(MAX_REPORTED_PEERS + 5):
            scenery.robot.handle_event(0.0, RobotOnline(number.to_bytes(16), 1, "theirs"))
        assert len(self.about(scenery).peers) == MAX_REPORTED_PEERS

    def test_it_answers_a_hundred_questions_a_second(self, scenery: Scenery) -> None:
        """Of both kinds together; those that are too many, or none, are faults."""
        node, ask = scenery.robot.node, encode(HistoryRequest(scenery.robot.node.incarnation, 1))
        (answer,) = scenery.ask("history", ask)
        assert len(decode_history_reply(answer).events) == 4, "its births"
        answers = [*(scenery.ask("history", ask) + scenery.ask("metadata", b"") for _ in range(80))]
        assert sum(map(len, answers)) == 99
        assert node.faults == {"malformed question": 61}
        scenery.unix_s += 1.0
        assert not scenery.ask("history", b"")
        assert not scenery.ask("metadata", b"?")
        assert node.faults == {"malformed question": 63}
        assert self.about(scenery)

    def test_captures_are_counted_over_all_generations_and_lives(
        self, scenery: Scenery, tmp_path: Path
    ) -> None:
        """Of those that have ended, and of the present one."""

        def message(scenery: Scenery) -> int:
            return scenery.robot.node.state(0).captures

        scenery.capture(1, 2, 0, 4)
        assert message(scenery) == 7
        scenery.turn_over()
        assert message(scenery) == 7
        scenery.capture(0, 1, 1, 0)
        assert message(scenery) == 9
        scenery.robot.node.save()
        scenery.store.close()
        again = Scenery(tmp_path)
        assert message(again) == 9
        again.turn_over()
        assert message(again) == 9
        again.store.close()


def test_it_is_done_after_the_last_generation(scenery: Scenery) -> None:
    """Of its config; a config without a last one goes on."""
    robot: Any = scenery.robot
    assert not robot.is_done
    robot.node.robot.generation = 3
    assert robot.is_done
