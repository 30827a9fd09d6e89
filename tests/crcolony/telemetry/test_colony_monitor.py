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
from crcolony.telemetry.backfill import ANSWER_S, MOST_UNDER_WAY, TURN_ROBOTS
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


def told(seq: int, life: int = 3, robot: RobotId = ME) -> EventMessage:
    return EventMessage(robot, life, seq, 7, Fault(seq, "x"))


def state(seq: int = 0, life: int = 3, robot: RobotId = ME) -> RobotState:
    assert isinstance(A_STATE, RobotState)
    return msgspec.structs.replace(A_STATE, robot=robot, life=life, seq=seq)


class Outlook(ColonyMonitor):
    """A watch, and what it is fed with in short words; `at_s` is when."""

    at_s = T

    def hear(
        self, kind: SampleKind, key: str, message: Message | bytes = b""
    ) -> list[StatusChange]:
        data = message if isinstance(message, bytes) else encode(message)
        return self.handle_sample(TelemetrySample(kind, key, data, int(1000.0 * self.at_s)))

    def come(self, life: int = 3, robot: RobotId = ME, session: str = "a") -> list[StatusChange]:
        return self.hear("alive", COLONY.alive(robot, life, session))

    def go(self, life: int = 3, robot: RobotId = ME, session: str = "a") -> list[StatusChange]:
        return self.hear("gone", COLONY.alive(robot, life, session))

    def state(self, state: RobotState) -> list[StatusChange]:
        return self.hear("state", COLONY.state(state.robot), state)

    def tell(self, *events: EventMessage) -> list[int]:
        """Return the numbers of those that are news."""
        return numbers([n for e in events for n in self.hear("event", COLONY.event(e.robot), e)])

    def introduce(self, life: int = 3) -> None:
        """Let a robot come, and answer what it is like."""
        self.come(life)
        self.due_requests(self.at_s)
        self.hear("metadata", COLONY.metadata(ME), RobotMetadata(ME, life, "{}", []))

    def missing(self) -> int:
        gaps = self.robots[ME].sequence
        assert gaps is not None
        return gaps.missing

    def past(self, oldest: int, events: Sequence[EventMessage], robot: RobotId = ME) -> list[int]:
        answer = HistoryReply(3, oldest, [encode(event) for event in events])
        return numbers(self.hear("history", COLONY.history(robot), answer))

    def asks(self, unix_s: float = T) -> list[tuple[str, HistoryRequest | None]]:
        """Return the keys of the questions now, with what is asked for."""
        return [
            (q.key, decode_history_request(q.payload) if q.payload else None)
            for q in self.due_requests(unix_s)
        ]


def numbers(news: list[StatusChange]) -> list[int]:
    return [one.message.seq for one in news if isinstance(one, EventReceived)]


@pytest.fixture
def watch() -> Outlook:
    return Outlook()


class TestPresence:
    """Who is on the network, and in which life."""

    def test_a_robot_is_there_until_its_last_token_has_gone(self, watch: Outlook) -> None:
        """A token that is told again, or that was never there, changes nothing."""
        assert watch.come(3) == [RobotJoined(ME)]
        assert watch.come(3) == []
        assert watch.come(3, session="b") == []
        assert watch.go(3) == []
        assert watch.go(3) == []
        assert [watched.robot for watched in watch.alive] == [ME]
        assert watch.go(3, session="b") == [RobotLeft(ME)]
        assert watch.alive == []
        assert watch.go(3, PEER) == []

    def test_a_newer_life_is_a_restart(self, watch: Outlook) -> None:
        """Whether its token comes before the old one goes, or after; the first life is none."""
        watch.come(3)
        assert watch.come(4, session="b") == [RobotRestarted(ME, 4)]
        watch.go(3)
        assert watch.go(4, session="b") == [RobotLeft(ME)]
        assert watch.come(5, session="c") == [RobotJoined(ME), RobotRestarted(ME, 5)]
        assert watch.robots[ME].restarts == 2
        assert watch.robots[ME].incarnations == {(5, "c"): None}

    def test_arenas_come_and_go(self, watch: Outlook) -> None:
        """By their tokens; the last scene and when it came are kept."""
        assert watch.hear("alive", ARENA.alive(7, "a")) == [ArenaJoined("lab")]
        assert watch.hear("alive", ARENA.alive(8, "b")) == []
        assert watch.hear("gone", ARENA.alive(7, "a")) == []
        assert watch.hear("scene", ARENA.scene, A_SCENE) == []
        assert watch.hear("gone", ARENA.alive(8, "b")) == [ArenaLeft("lab")]
        arena = watch.arenas["lab"]
        assert (arena.scene, arena.updated_s) == (A_SCENE, T)
        assert not arena.is_alive

    def test_a_robot_that_changes_its_colony_is_found_there(self, watch: Outlook) -> None:
        """Its token says where it is, whatever others published in its name."""
        key = ColonyKeys("lies").state(ME)
        watch.hear("state", key, state())
        watch.come(3)
        assert watch.robots[ME].colony == "blue"


class TestEvents:
    """Each event of each life is news exactly once."""

    def test_repetitions_are_no_news_and_late_ones_are(self, watch: Outlook) -> None:
        """A gap is missed until it is filled."""
        assert watch.tell(told(5), told(5), told(9), told(7), told(7)) == [5, 9, 7]
        assert watch.robots[ME].missed == 2
        assert watch.tell(told(6), told(8), told(6)) == [6, 8]
        assert watch.robots[ME].missed == 0

    def test_a_state_tells_that_some_were_missed(self, watch: Outlook) -> None:
        """What was before the first word of a life is not."""
        watch.state(state(seq=20))
        assert watch.robots[ME].missed == 0
        watch.state(state(seq=22))
        assert watch.robots[ME].missed == 2
        assert (watch.robots[ME].state, watch.robots[ME].updated_s) == (state(seq=22), T)

    def test_a_newer_life_counts_from_its_own_beginning(self, watch: Outlook) -> None:
        """Late events of the life before are news if they were missing, and else they are counted."""
        watch.tell(told(5), told(9))
        news = watch.hear("event", COLONY.event(ME), told(1, life=4))
        assert news == [RobotRestarted(ME, 4), EventReceived(told(1, life=4))]
        assert watch.tell(told(7), told(7), told(10), told(3, life=2)) == [7]
        assert watch.stale == 3
        assert watch.robots[ME].missed == 2

    def test_an_older_life_says_nothing_of_the_present_one(self, watch: Outlook) -> None:
        """Its states are counted and ignored."""
        watch.state(state(seq=20, life=4))
        watch.state(state(seq=30, life=3))
        assert watch.robots[ME].state == state(seq=20, life=4)
        assert (watch.stale, watch.robots[ME].missed) == (1, 0)

    def test_a_life_without_a_token_is_not_believed_of_who_has_one(self, watch: Outlook) -> None:
        """Or one lie about a life to come would silence a robot for ever."""
        watch.come(3)
        assert watch.state(state(life=2**32 - 1, seq=2**50)) == []
        assert watch.tell(told(2**50, life=2**32 - 1)) == []
        assert watch.stale == 2
        assert watch.tell(told(1)) == [1]

    def test_what_is_missed_is_remembered_over_many_lives(self, watch: Outlook) -> None:
        """Three in each."""
        for life in range(10):
            watch.tell(told(1, life), told(5, life))
        assert watch.robots[ME].missed == 30


@given(
    st.lists(st.sampled_from(["lost", "once", "twice", "late"]), min_size=1, max_size=300),
    st.lists(st.booleans(), max_size=40),
)
def test_each_event_is_news_once_whatever_is_lost_repeated_or_late(
    fates: list[str], answers: list[bool]
) -> None:
    """Of live events, and of answers: after all of them nothing is missing."""
    watch, ring, heard = Outlook(history=10_000), EventBuffer(ME, 3), list[int]()
    watch.come(3)
    late: list[EventMessage] = []
    for fate in fates:
        event = msgspec.msgpack.decode(ring.append(Fault(0, "x"), 7), type=EventMessage)
        heard += watch.tell(*([event] * {"once": 1, "twice": 2}.get(fate, 0)))
        late += [event] if fate == "late" else []
    watch.state(state(seq=ring.seq))
    chances = iter(answers)
    while watch.missing():
        watch.at_s += PATIENCE_S
        for question in watch.due_requests(watch.at_s):
            if question.kind == "history" and next(chances, True):
                answer = encode(ring.reply_to(decode_history_request(question.payload)))
                heard += numbers(watch.hear("history", question.key, answer))
        heard += watch.tell(*late[:3])
        late = late[2:]
        watch.at_s += ANSWER_S
    heard += watch.tell(*late)
    robot = watch.robots[ME]
    assert len(heard) == len(set(heard))
    assert robot.missed == ring.seq - len(heard)
    if all(answers):
        assert sorted(heard) == list(range(1, ring.seq + 1))


class TestQuestions:
    """Few at a time, none for ever, and nobody is asked two at a time."""

    def test_what_is_missing_is_asked_for(self, watch: Outlook) -> None:
        """Who is on the network is asked, one question at a time, until nothing is missing."""
        watch.tell(told(1), told(100))
        assert watch.asks() == []
        watch.come(3)
        assert watch.asks() == [(COLONY.metadata(ME), None)]
        assert watch.asks() == []
        watch.hear("metadata", COLONY.metadata(ME), RobotMetadata(ME, 3, "{}", [PEER]))
        assert watch.asks() == [(COLONY.history(ME), HistoryRequest(3, 2))]
        assert watch.asks() == []
        assert watch.past(1, [told(seq) for seq in range(2, 66)]) == [*range(2, 66)]
        assert watch.asks() == [(COLONY.history(ME), HistoryRequest(3, 66))]
        watch.past(1, [told(seq) for seq in range(66, 130)])
        assert watch.asks() == []
        assert watch.robots[ME].missed == 0

    def test_history_goes_back_as_far_as_it_is_kept(self) -> None:
        """What is kept no more is not missed."""
        watch = Outlook(history=50)
        watch.introduce()
        watch.state(state(seq=200))
        assert watch.asks() == [(COLONY.history(ME), HistoryRequest(3, 151))]
        assert watch.past(190, [told(seq) for seq in range(190, 201)]) == [*range(190, 201)]
        assert watch.asks() == []
        assert watch.robots[ME].missed == 0

    def test_a_question_without_an_answer_is_given_up_after_some_tries(
        self, watch: Outlook
    ) -> None:
        """What it was for is missed then; a new life is asked about anew."""
        watch.come(3)
        watch.tell(told(1), told(9))
        asked = [watch.asks(T + ANSWER_S * k) for k in range(4 * TRIES)]
        keys = [key for questions in asked for key, _ in questions]
        assert keys.count(COLONY.history(ME)) == TRIES
        assert keys.count(COLONY.metadata(ME)) >= TRIES
        assert watch.robots[ME].missed == 7
        watch.come(4, session="b")
        assert (COLONY.metadata(ME), None) in watch.asks(T + 1_000.0)

    def test_an_event_that_never_was_is_asked_for_once(self, watch: Outlook) -> None:
        """A lying state costs a question, and nothing that comes afterwards."""
        watch.introduce()
        watch.tell(told(1))
        watch.state(state(seq=2**50))
        assert watch.asks(T + PATIENCE_S) == [(COLONY.history(ME), HistoryRequest(3, 2))]
        watch.past(1, [])
        assert watch.asks(T + PATIENCE_S) == []
        assert watch.robots[ME].missed == 0
        assert watch.tell(told(2), told(4)) == [2, 4]
        assert watch.robots[ME].missed == 1

    def test_few_are_asked_at_a_time_and_everybody_in_turn(self, watch: Outlook) -> None:
        """Who never answers keeps nobody from being asked."""
        for robot in IDS:
            watch.come(3, robot)
            watch.tell(told(1, robot=robot), told(3, robot=robot))
        asked: set[str] = set()
        for k in range(60):
            questions = watch.due_requests(T + ANSWER_S * k)
            assert len(questions) <= MOST_UNDER_WAY
            chunks = [question.key.rpartition("/")[2] for question in questions]
            assert len(set(chunks)) == len(chunks)
            asked |= {question.key for question in questions}
        assert asked >= {COLONY.history(robot) for robot in IDS}
        assert asked >= {COLONY.metadata(robot) for robot in IDS}

    def test_robots_are_asked_about_again_in_turn(self) -> None:
        """Some in every period; who is gone is not."""
        watch = Outlook(about_period_s=50.0)
        for robot in IDS:
            watch.come(3, robot)
        watch.go(3, IDS[0])

        def asked(from_s: float) -> list[str]:
            """Who is asked about, when all answer at once, for half a period."""
            found = []
            for k in range(20):
                for key, _ in watch.asks(from_s + k):
                    robot = bytes.fromhex(key.rpartition("/")[2])
                    watch.hear("metadata", key, RobotMetadata(robot, 3, "{}", []))
                    found.append(key)
            return found

        everybody = {COLONY.metadata(robot) for robot in IDS[1:]}
        assert set(asked(T)) == everybody
        again = [asked(T + 50.0 * k) for k in range(1, 5)]
        assert [len(keys) for keys in again] == [TURN_ROBOTS] * 4
        assert {key for keys in again for key in keys} == everybody

    def test_an_arena_is_asked_once_in_every_world(self, watch: Outlook) -> None:
        """What it answers is kept."""
        about = ArenaMetadata("lab", 7, '{"arena":{}}')
        watch.hear("alive", ARENA.alive(7, "a"))
        assert watch.asks() == [(ARENA.metadata, None)]
        watch.hear("metadata", ARENA.metadata, about)
        assert watch.arenas["lab"].metadata == about
        watch.hear("scene", ARENA.scene, A_SCENE)
        assert watch.asks(T + 1_000.0) == []
        watch.hear("alive", ARENA.alive(8, "b"))
        assert watch.asks(T + 1_000.0) == [(ARENA.metadata, None)]

    def test_what_a_robot_answers_about_itself_is_kept(self, watch: Outlook) -> None:
        """Of its present life."""
        about = RobotMetadata(ME, 3, '{"body":{}}', [PEER])
        watch.come(3)
        watch.hear("metadata", COLONY.metadata(ME), about)
        watch.hear("metadata", COLONY.metadata(ME), RobotMetadata(ME, 2, "{}", []))
        assert watch.robots[ME].metadata == about
        assert watch.stale == 1

    def test_a_clock_that_is_set_back_holds_up_no_question(self, watch: Outlook) -> None:
        """What was asked in the future counts as unanswered."""
        watch.come(3)
        assert len(watch.asks(T + 1e6)) == 1
        assert len(watch.asks(T)) == 1


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
            ("event", COLONY.event(PEER), told(1)),
            ("event", COLONY.event(ME), told(0)),
            ("scene", ARENA.scene, b"\x90"),
            ("scene", ArenaKeys("other").scene, A_SCENE),
            ("history", COLONY.history(PEER), HistoryReply(3, 1, [encode(told(1))])),
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
        self, watch: Outlook, kind: SampleKind, key: str, message: Message | bytes
    ) -> None:
        """Keys and messages of every kind, and messages that do not say what their keys do."""
        assert watch.hear(kind, key, message) == []
        assert watch.malformed == 1
        assert watch.robots == {}
        assert watch.arenas == {}
        assert watch.samples == {kind: 1}
        assert watch.bytes == len(message if isinstance(message, bytes) else encode(message))

    def test_one_malformed_event_does_not_spoil_an_answer(self, watch: Outlook) -> None:
        """The others are news."""
        data = [encode(told(1)), b"noise", encode(told(3)), encode(told(4, robot=PEER))]
        news = watch.hear("history", COLONY.history(ME), HistoryReply(3, 1, data))
        assert numbers(news) == [1, 3]
        assert watch.malformed == 2

    def test_who_has_no_token_makes_room(
        self, watch: Outlook, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """The longest silent first; where all are alive a newcomer is ignored."""
        monkeypatch.setattr(presence, "MOST_ROBOTS", 3)
        watch = Outlook()
        watch.come(3, IDS[0])
        for number in (1, 2, 1, 3):
            watch.state(state(robot=IDS[number]))
        assert set(watch.robots) == {IDS[0], IDS[1], IDS[3]}
        watch.come(3, IDS[1])
        watch.come(3, IDS[4])
        assert set(watch.robots) == {IDS[0], IDS[1], IDS[4]}
        assert watch.come(3, IDS[5]) == []
        assert watch.state(state(robot=IDS[5])) == []
        assert watch.tell(told(1, robot=IDS[5])) == []
        assert watch.ignored == 3

    def test_who_is_gone_and_silent_is_forgotten(self, watch: Outlook) -> None:
        """Who has a token is not, however silent it is; and nobody is asked any more who is forgotten."""
        for robot in (ME, PEER):
            watch.come(3, robot)
            watch.tell(told(1, robot=robot), told(3, robot=robot))
        watch.hear("scene", ARENA.scene, A_SCENE)
        watch.at_s = T + 100.0
        watch.go(3, ME)
        watch.handle_timeouts(T + presence.FORGET_S + 50.0)
        assert set(watch.robots) == {ME, PEER}
        assert watch.arenas == {}
        watch.handle_timeouts(T + presence.FORGET_S + 101.0)
        assert set(watch.robots) == {PEER}
        assert all(key.endswith(PEER.hex()) for key, _ in watch.asks(T + 1_000.0))

    def test_a_thousand_tokens_of_one_robot_are_too_many(self, watch: Outlook) -> None:
        """Those that are too many are ignored."""
        for number in range(1000):
            watch.come(3, session=str(number))
            watch.hear("alive", ARENA.alive(number, "a"))
        assert len(watch.robots[ME].incarnations) == len(watch.arenas["lab"].sessions) == 100
        assert watch.ignored == 1800
