"""A watcher tells each event once, knows what it missed and asks for it, and is not thrown by what it hears."""

from collections.abc import Sequence

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crcolony.nodes.event_buffer import EventBuffer
from crcolony.protocol.codec import Message, encode
from crcolony.protocol.identity import RobotId, seeded
from crcolony.protocol.key_expressions import ArenaKeys, ColonyKeys
from crcolony.protocol.telemetry_messages import (
    ArenaMetadata,
    EventMessage,
    Fault,
    HistoryReply,
    HistoryRequest,
    RobotMetadata,
    RobotState,
    decode_history_request,
)
from crcolony.telemetry import presence
from crcolony.telemetry.backfill import ANSWER_S, MAX_UNDER_WAY, TURN_ROBOTS
from crcolony.telemetry.colony_monitor import ColonyMonitor, SampleKind, TelemetrySample
from crcolony.telemetry.sequence_gaps import PATIENCE_S, TRIES
from crcolony.telemetry.status_changes import (
    ArenaJoined,
    ArenaLeft,
    EventReceived,
    RobotJoined,
    RobotLeft,
    RobotRestarted,
    StatusChange,
)
from tests.vectors.make import TELEMETRY

IDS = [seeded("test", 1, number).id for number in range(100)]
ME, PEER = IDS[:2]
COLONY, ARENA = ColonyKeys("blue"), ArenaKeys("lab")
T = 1_000.0
"""Unix seconds"""
A_STATE, A_SCENE = TELEMETRY["state"], TELEMETRY["scene"]


def message(seq: int, incarnation: int = 3, robot: RobotId = ME) -> EventMessage:
    return EventMessage(robot, incarnation, seq, 7, Fault(seq, "x"))


def state(seq: int = 0, incarnation: int = 3, robot: RobotId = ME) -> RobotState:
    assert isinstance(A_STATE, RobotState)
    return msgspec.structs.replace(A_STATE, robot=robot, incarnation=incarnation, seq=seq)


class Outlook(ColonyMonitor):
    """A watch, and what it is fed with in short words; `at_s` is when."""

    at_s = T

    def on_event(
        self, kind: SampleKind, key: str, message: Message | bytes = b""
    ) -> list[StatusChange]:
        data = message if isinstance(message, bytes) else encode(message)
        return self.handle_sample(TelemetrySample(kind, key, data, int(1000.0 * self.at_s)))

    def come(
        self, incarnation: int = 3, robot: RobotId = ME, session: str = "a"
    ) -> list[StatusChange]:
        return self.on_event("alive", COLONY.alive(robot, incarnation, session))

    def go(
        self, incarnation: int = 3, robot: RobotId = ME, session: str = "a"
    ) -> list[StatusChange]:
        return self.on_event("gone", COLONY.alive(robot, incarnation, session))

    def state(self, state: RobotState) -> list[StatusChange]:
        return self.on_event("state", COLONY.state(state.robot), state)

    def tell(self, *events: EventMessage) -> list[int]:
        """Return the numbers of those that are news."""
        return numbers(
            [n for e in events for n in self.on_event("event", COLONY.event(e.robot), e)]
        )

    def introduce(self, incarnation: int = 3) -> None:
        """Let a robot come, and answer what it is like."""
        self.come(incarnation)
        self.due_requests(self.at_s)
        self.on_event("metadata", COLONY.metadata(ME), RobotMetadata(ME, incarnation, "{}", []))

    def missing(self) -> int:
        sequence = self.robots[ME].sequence
        assert sequence is not None
        return sequence.missing

    def past(self, oldest: int, events: Sequence[EventMessage], robot: RobotId = ME) -> list[int]:
        answer = HistoryReply(3, oldest, [encode(event) for event in events])
        return numbers(self.on_event("history", COLONY.history(robot), answer))

    def asks(self, unix_s: float = T) -> list[tuple[str, HistoryRequest | None]]:
        """Return the keys of the questions now, with what is asked for."""
        return [
            (q.key, decode_history_request(q.payload) if q.payload else None)
            for q in self.due_requests(unix_s)
        ]


def numbers(changes: list[StatusChange]) -> list[int]:
    return [one.message.seq for one in changes if isinstance(one, EventReceived)]


@pytest.fixture
def monitor() -> Outlook:
    return Outlook()


class TestPresence:
    """Who is on the network, and in which life."""

    def test_a_robot_is_there_until_its_last_token_has_gone(self, monitor: Outlook) -> None:
        """A token that is told again, or that was never there, changes nothing."""
        assert monitor.come(3) == [RobotJoined(ME)]
        assert monitor.come(3) == []
        assert monitor.come(3, session="b") == []
        assert monitor.go(3) == []
        assert monitor.go(3) == []
        assert [status.robot for status in monitor.alive] == [ME]
        assert monitor.go(3, session="b") == [RobotLeft(ME)]
        assert monitor.alive == []
        assert monitor.go(3, PEER) == []

    def test_a_newer_life_is_a_restart(self, monitor: Outlook) -> None:
        """Whether its token comes before the old one goes, or after; the first life is none."""
        monitor.come(3)
        assert monitor.come(4, session="b") == [RobotRestarted(ME, 4)]
        monitor.go(3)
        assert monitor.go(4, session="b") == [RobotLeft(ME)]
        assert monitor.come(5, session="c") == [RobotJoined(ME), RobotRestarted(ME, 5)]
        assert monitor.robots[ME].restarts == 2
        assert monitor.robots[ME].incarnations == {(5, "c"): None}

    def test_arenas_come_and_go(self, monitor: Outlook) -> None:
        """By their tokens; the last scene and when it came are kept."""
        assert monitor.on_event("alive", ARENA.alive(7, "a")) == [ArenaJoined("lab")]
        assert monitor.on_event("alive", ARENA.alive(8, "b")) == []
        assert monitor.on_event("gone", ARENA.alive(7, "a")) == []
        assert monitor.on_event("scene", ARENA.scene, A_SCENE) == []
        assert monitor.on_event("gone", ARENA.alive(8, "b")) == [ArenaLeft("lab")]
        arena = monitor.arenas["lab"]
        assert (arena.scene, arena.updated_s) == (A_SCENE, T)
        assert not arena.is_alive

    def test_a_robot_that_changes_its_colony_is_found_there(self, monitor: Outlook) -> None:
        """Its token says where it is, whatever others published in its name."""
        key = ColonyKeys("lies").state(ME)
        monitor.on_event("state", key, state())
        monitor.come(3)
        assert monitor.robots[ME].colony == "blue"


class TestEvents:
    """Each event of each life is news exactly once."""

    def test_repetitions_are_no_news_and_late_ones_are(self, monitor: Outlook) -> None:
        """A gap is missed until it is filled."""
        assert monitor.tell(message(5), message(5), message(9), message(7), message(7)) == [5, 9, 7]
        assert monitor.robots[ME].missed == 2
        assert monitor.tell(message(6), message(8), message(6)) == [6, 8]
        assert monitor.robots[ME].missed == 0

    def test_a_state_tells_that_some_were_missed(self, monitor: Outlook) -> None:
        """What was before the first word of a life is not."""
        monitor.state(state(seq=20))
        assert monitor.robots[ME].missed == 0
        monitor.state(state(seq=22))
        assert monitor.robots[ME].missed == 2
        assert (monitor.robots[ME].state, monitor.robots[ME].updated_s) == (state(seq=22), T)

    def test_a_newer_life_counts_from_its_own_beginning(self, monitor: Outlook) -> None:
        """Late events of the life before are news if they were missing, and else they are counted."""
        monitor.tell(message(5), message(9))
        changes = monitor.on_event("event", COLONY.event(ME), message(1, incarnation=4))
        assert changes == [RobotRestarted(ME, 4), EventReceived(message(1, incarnation=4))]
        assert monitor.tell(message(7), message(7), message(10), message(3, incarnation=2)) == [7]
        assert monitor.stale == 3
        assert monitor.robots[ME].missed == 2

    def test_an_older_life_says_nothing_of_the_present_one(self, monitor: Outlook) -> None:
        """Its states are counted and ignored."""
        monitor.state(state(seq=20, incarnation=4))
        monitor.state(state(seq=30, incarnation=3))
        assert monitor.robots[ME].state == state(seq=20, incarnation=4)
        assert (monitor.stale, monitor.robots[ME].missed) == (1, 0)

    def test_a_life_without_a_token_is_not_believed_of_who_has_one(self, monitor: Outlook) -> None:
        """Or one lie about a life to come would silence a robot for ever."""
        monitor.come(3)
        assert monitor.state(state(incarnation=2**32 - 1, seq=2**50)) == []
        assert monitor.tell(message(2**50, incarnation=2**32 - 1)) == []
        assert monitor.stale == 2
        assert monitor.tell(message(1)) == [1]

    def test_what_is_missed_is_remembered_over_many_lives(self, monitor: Outlook) -> None:
        """Three in each."""
        for incarnation in range(10):
            monitor.tell(message(1, incarnation), message(5, incarnation))
        assert monitor.robots[ME].missed == 30


@given(
    st.lists(st.sampled_from(["lost", "once", "twice", "late"]), min_size=1, max_size=300),
    st.lists(st.booleans(), max_size=40),
)
def test_each_event_is_news_once_whatever_is_lost_repeated_or_late(
    fates: list[str], answers: list[bool]
) -> None:
    """Of live events, and of answers: after all of them nothing is missing."""
    monitor, ring, sample = Outlook(history=10_000), EventBuffer(ME, 3), list[int]()
    monitor.come(3)
    late: list[EventMessage] = []
    for fate in fates:
        event = msgspec.msgpack.decode(ring.append(Fault(0, "x"), 7), type=EventMessage)
        sample += monitor.tell(*([event] * {"once": 1, "twice": 2}.get(fate, 0)))
        late += [event] if fate == "late" else []
    monitor.state(state(seq=ring.seq))
    chances = iter(answers)
    while monitor.missing():
        monitor.at_s += PATIENCE_S
        for request in monitor.due_requests(monitor.at_s):
            if request.kind == "history" and next(chances, True):
                answer = encode(ring.reply_to(decode_history_request(request.payload)))
                sample += numbers(monitor.on_event("history", request.key, answer))
        sample += monitor.tell(*late[:3])
        late = late[2:]
        monitor.at_s += ANSWER_S
    sample += monitor.tell(*late)
    robot = monitor.robots[ME]
    assert len(sample) == len(set(sample))
    assert robot.missed == ring.seq - len(sample)
    if all(answers):
        assert sorted(sample) == list(range(1, ring.seq + 1))


class TestQuestions:
    """Few at a time, none for ever, and nobody is asked two at a time."""

    def test_what_is_missing_is_asked_for(self, monitor: Outlook) -> None:
        """Who is on the network is asked, one question at a time, until nothing is missing."""
        monitor.tell(message(1), message(100))
        assert monitor.asks() == []
        monitor.come(3)
        assert monitor.asks() == [(COLONY.metadata(ME), None)]
        assert monitor.asks() == []
        monitor.on_event("metadata", COLONY.metadata(ME), RobotMetadata(ME, 3, "{}", [PEER]))
        assert monitor.asks() == [(COLONY.history(ME), HistoryRequest(3, 2))]
        assert monitor.asks() == []
        assert monitor.past(1, [message(seq) for seq in range(2, 66)]) == [*range(2, 66)]
        assert monitor.asks() == [(COLONY.history(ME), HistoryRequest(3, 66))]
        monitor.past(1, [message(seq) for seq in range(66, 130)])
        assert monitor.asks() == []
        assert monitor.robots[ME].missed == 0

    def test_history_goes_back_as_far_as_it_is_kept(self) -> None:
        """What is kept no more is not missed."""
        monitor = Outlook(history=50)
        monitor.introduce()
        monitor.state(state(seq=200))
        assert monitor.asks() == [(COLONY.history(ME), HistoryRequest(3, 151))]
        assert monitor.past(190, [message(seq) for seq in range(190, 201)]) == [*range(190, 201)]
        assert monitor.asks() == []
        assert monitor.robots[ME].missed == 0

    def test_a_question_without_an_answer_is_given_up_after_some_tries(
        self, monitor: Outlook
    ) -> None:
        """What it was for is missed then; a new life is asked about anew."""
        monitor.come(3)
        monitor.tell(message(1), message(9))
        asked = [monitor.asks(T + ANSWER_S * k) for k in range(4 * TRIES)]
        keys = [key for questions in asked for key, _ in questions]
        assert keys.count(COLONY.history(ME)) == TRIES
        assert keys.count(COLONY.metadata(ME)) >= TRIES
        assert monitor.robots[ME].missed == 7
        monitor.come(4, session="b")
        assert (COLONY.metadata(ME), None) in monitor.asks(T + 1_000.0)

    def test_an_event_that_never_was_is_asked_for_once(self, monitor: Outlook) -> None:
        """A lying state costs a question, and nothing that comes afterwards."""
        monitor.introduce()
        monitor.tell(message(1))
        monitor.state(state(seq=2**50))
        assert monitor.asks(T + PATIENCE_S) == [(COLONY.history(ME), HistoryRequest(3, 2))]
        monitor.past(1, [])
        assert monitor.asks(T + PATIENCE_S) == []
        assert monitor.robots[ME].missed == 0
        assert monitor.tell(message(2), message(4)) == [2, 4]
        assert monitor.robots[ME].missed == 1

    def test_few_are_asked_at_a_time_and_everybody_in_turn(self, monitor: Outlook) -> None:
        """Who never answers keeps nobody from being asked."""
        for robot in IDS:
            monitor.come(3, robot)
            monitor.tell(message(1, robot=robot), message(3, robot=robot))
        asked: set[str] = set()
        for k in range(60):
            questions = monitor.due_requests(T + ANSWER_S * k)
            assert len(questions) <= MAX_UNDER_WAY
            chunks = [request.key.rpartition("/")[2] for request in questions]
            assert len(set(chunks)) == len(chunks)
            asked |= {request.key for request in questions}
        assert asked >= {COLONY.history(robot) for robot in IDS}
        assert asked >= {COLONY.metadata(robot) for robot in IDS}

    def test_robots_are_asked_about_again_in_turn(self) -> None:
        """Some in every period; who is gone is not."""
        monitor = Outlook(about_period_s=50.0)
        for robot in IDS:
            monitor.come(3, robot)
        monitor.go(3, IDS[0])

        def asked(from_s: float) -> list[str]:
            """Who is asked about, when all answer at once, for half a period."""
            found = []
            for k in range(20):
                for key, _ in monitor.asks(from_s + k):
                    robot = bytes.fromhex(key.rpartition("/")[2])
                    monitor.on_event("metadata", key, RobotMetadata(robot, 3, "{}", []))
                    found.append(key)
            return found

        everybody = {COLONY.metadata(robot) for robot in IDS[1:]}
        assert set(asked(T)) == everybody
        again = [asked(T + 50.0 * k) for k in range(1, 5)]
        assert [len(keys) for keys in again] == [TURN_ROBOTS] * 4
        assert {key for keys in again for key in keys} == everybody

    def test_an_arena_is_asked_once_in_every_world(self, monitor: Outlook) -> None:
        """What it answers is kept."""
        about = ArenaMetadata("lab", 7, '{"arena":{}}')
        monitor.on_event("alive", ARENA.alive(7, "a"))
        assert monitor.asks() == [(ARENA.metadata, None)]
        monitor.on_event("metadata", ARENA.metadata, about)
        assert monitor.arenas["lab"].metadata == about
        monitor.on_event("scene", ARENA.scene, A_SCENE)
        assert monitor.asks(T + 1_000.0) == []
        monitor.on_event("alive", ARENA.alive(8, "b"))
        assert monitor.asks(T + 1_000.0) == [(ARENA.metadata, None)]

    def test_what_a_robot_answers_about_itself_is_kept(self, monitor: Outlook) -> None:
        """Of its present life."""
        about = RobotMetadata(ME, 3, '{"body":{}}', [PEER])
        monitor.come(3)
        monitor.on_event("metadata", COLONY.metadata(ME), about)
        monitor.on_event("metadata", COLONY.metadata(ME), RobotMetadata(ME, 2, "{}", []))
        assert monitor.robots[ME].metadata == about
        assert monitor.stale == 1

    def test_a_clock_that_is_set_back_holds_up_no_question(self, monitor: Outlook) -> None:
        """What was asked in the future counts as unanswered."""
        monitor.come(3)
        assert len(monitor.asks(T + 1e6)) == 1
        assert len(monitor.asks(T)) == 1


class TestLies:
    """Anybody can publish anything: it is counted, and costs little."""

    @pytest.mark.parametrize(
        ("kind", "key", "message"),
        [
            ("alive", "crcolony/1/colony/blue/alive/nobody/3/abc", b""),
            ("alive", COLONY.alive(ME, 3, "x" * 65), b""),
            ("alive", ColonyKeys("b" * 65).alive(ME, 3, "x"), b""),
            ("gone", "crcolony/1/arena/lab/alive/x/abc", b""),
            ("state", COLONY.state(ME), b"\xc1"),
            ("state", COLONY.state(PEER), state()),
            ("state", COLONY.event(ME), state()),
            ("state", "crcolony/1/colony/blue/state/x", state()),
            ("event", COLONY.event(ME), b""),
            ("event", COLONY.event(PEER), message(1)),
            ("event", COLONY.event(ME), message(0)),
            ("scene", ARENA.scene, b"\x90"),
            ("scene", ArenaKeys("other").scene, A_SCENE),
            ("history", COLONY.history(PEER), HistoryReply(3, 1, [encode(message(1))])),
            ("history", COLONY.history(ME), HistoryReply(3, 1, [b"noise"])),
            ("metadata", COLONY.metadata(PEER), RobotMetadata(ME, 3, "{}", [])),
            ("metadata", COLONY.metadata(ME), RobotMetadata(ME, 3, "[1]", [])),
            ("metadata", COLONY.metadata(ME), RobotMetadata(ME, 3, "[" * 8000, [])),
            ("metadata", ARENA.metadata, ArenaMetadata("other", 7, "{}")),
            ("metadata", ARENA.metadata, ArenaMetadata("lab", 7, "nothing")),
            ("metadata", ARENA.metadata, RobotMetadata(ME, 3, "{}", [])),
        ],
    )
    def test_what_is_malformed_is_counted(
        self, monitor: Outlook, kind: SampleKind, key: str, message: Message | bytes
    ) -> None:
        """Keys and messages of every kind, and messages that do not say what their keys do."""
        assert monitor.on_event(kind, key, message) == []
        assert monitor.malformed == 1
        assert monitor.robots == {}
        assert monitor.arenas == {}
        assert monitor.samples == {kind: 1}
        assert monitor.bytes == len(message if isinstance(message, bytes) else encode(message))

    def test_one_malformed_event_does_not_spoil_an_answer(self, monitor: Outlook) -> None:
        """The others are news."""
        data = [encode(message(1)), b"noise", encode(message(3)), encode(message(4, robot=PEER))]
        changes = monitor.on_event("history", COLONY.history(ME), HistoryReply(3, 1, data))
        assert numbers(changes) == [1, 3]
        assert monitor.malformed == 2

    def test_who_has_no_token_makes_room(
        self, monitor: Outlook, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """The longest silent first; where all are alive a newcomer is ignored."""
        monkeypatch.setattr(presence, "MAX_ROBOTS", 3)
        monitor = Outlook()
        monitor.come(3, IDS[0])
        for number in (1, 2, 1, 3):
            monitor.state(state(robot=IDS[number]))
        assert set(monitor.robots) == {IDS[0], IDS[1], IDS[3]}
        monitor.come(3, IDS[1])
        monitor.come(3, IDS[4])
        assert set(monitor.robots) == {IDS[0], IDS[1], IDS[4]}
        assert monitor.come(3, IDS[5]) == []
        assert monitor.state(state(robot=IDS[5])) == []
        assert monitor.tell(message(1, robot=IDS[5])) == []
        assert monitor.ignored == 3

    def test_who_is_gone_and_silent_is_forgotten(self, monitor: Outlook) -> None:
        """Who has a token is not, however silent it is; and nobody is asked any more who is forgotten."""
        for robot in (ME, PEER):
            monitor.come(3, robot)
            monitor.tell(message(1, robot=robot), message(3, robot=robot))
        monitor.on_event("scene", ARENA.scene, A_SCENE)
        monitor.at_s = T + 100.0
        monitor.go(3, ME)
        monitor.handle_timeouts(T + presence.FORGET_S + 50.0)
        assert set(monitor.robots) == {ME, PEER}
        assert monitor.arenas == {}
        monitor.handle_timeouts(T + presence.FORGET_S + 101.0)
        assert set(monitor.robots) == {PEER}
        assert all(key.endswith(PEER.hex()) for key, _ in monitor.asks(T + 1_000.0))

    def test_a_thousand_tokens_of_one_robot_are_too_many(self, monitor: Outlook) -> None:
        """Those that are too many are ignored."""
        for number in range(1000):
            monitor.come(3, session=str(number))
            monitor.on_event("alive", ARENA.alive(number, "a"))
        assert len(monitor.robots[ME].incarnations) == len(monitor.arenas["lab"].sessions) == 100
        assert monitor.ignored == 1800
