"""A robot requests a body, acts on its observations, and recovers from silence, forged messages and lost links."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from crcolony.body.contract import OBSERVATION_WIDTH
from crcolony.nodes.embodied_robot import DuplicateIdentityError
from crcolony.protocol.body_messages import (
    BodyDenied,
    Contact,
    Join,
    Leave,
    pack_row,
)
from crcolony.protocol.codec import encode
from crcolony.protocol.identity import seeded
from crcolony.protocol.telemetry_messages import ArenaMetadata, decode_activity
from crcolony.transport.interface import (
    ArenaOffline,
    ArenaOnline,
    IncompatiblePeer,
    JoinReplyReceived,
    RobotOffline,
    RobotOnline,
)
from tests.support.lone_robot import ARENA_RUN, COLONY, ME, PEER, LoneRobot


class TestBody:
    def test_it_requests_a_body_until_it_has_one(self, lone: LoneRobot) -> None:
        """When an arena comes online, and every second."""
        lone.robot.handle_timers(0.0)
        lone.robot.handle_event(0.1, ArenaOnline(ARENA_RUN))
        lone.robot.handle_timers(0.2)
        lone.robot.handle_timers(1.2)
        assert len(set(lone.transport.requests)) == 1, "it is the same request until it is answered"
        (first, second) = lone.requested
        assert isinstance(first, Join)
        assert (first.robot, first.colony, first.slot, first.arena_run) == (
            ME.id, COLONY, -1, ARENA_RUN,
        )  # fmt: skip
        assert first == second
        lone.grant_body(1.3)
        requests = len(lone.transport.requests)
        lone.robot.handle_timers(2.4)
        assert len(lone.transport.requests) == requests
        assert lone.robot.has_body
        assert lone.node.number == 2

    def test_it_answers_every_observation_once(self, lone: LoneRobot) -> None:
        """One that arrives twice, late, or from another run of the arena is not answered."""
        lone.grant_body(0.0)
        for tick in (1, 2, 2, 1, 3):
            lone.observe(0.1 * tick, tick)
        lone.observe(0.5, 4, arena_run=ARENA_RUN + 1)
        assert lone.acted == [1, 2, 3]

    def test_in_lockstep_it_repeats_an_action_that_was_lost(self, lone: LoneRobot) -> None:
        """The same action, without another control step."""
        lone.grant_body(0.0, lockstep=True)
        lone.observe(0.1, 1)
        steps = lone.node.robot.steps
        lone.observe(0.6, 1)
        assert lone.acted == [1, 1]
        assert lone.transport.actions[0] == lone.transport.actions[1]
        assert lone.node.robot.steps == steps

    def test_without_a_body_it_does_not_act(self, lone: LoneRobot) -> None:
        """Nor after the arena went offline; another run of the arena grants another body."""
        lone.observe(0.0, 1)
        lone.grant_body(0.1)
        lone.robot.handle_event(0.2, ArenaOffline(ARENA_RUN + 1))
        lone.observe(0.3, 2)
        lone.robot.handle_event(0.4, ArenaOffline(ARENA_RUN))
        lone.observe(0.5, 3)
        assert lone.acted == [2]
        assert "the arena is offline; waiting for arena here" in lone.lines
        lone.grant_body(0.6, arena_run=ARENA_RUN + 1)
        lone.observe(0.7, 1, arena_run=ARENA_RUN + 1)
        assert lone.acted == [2, 1]

    def test_it_requests_a_body_that_is_silent_again(self, lone: LoneRobot) -> None:
        """After 3 s; an observation that is far ahead of the last one is refused."""
        lone.grant_body(0.0)
        lone.observe(0.1, 2**40)
        lone.observe(0.2, 2)
        assert lone.acted == [2]
        lone.robot.handle_timers(3.1)
        assert len(lone.transport.requests) == 1
        lone.robot.handle_timers(3.3)
        assert len(lone.transport.requests) == 2
        lone.grant_body(3.3, tick=30)
        lone.observe(3.4, 31)
        assert lone.acted == [2, 31]

    @pytest.mark.parametrize("row", [pack_row(np.full(OBSERVATION_WIDTH, np.nan)), b"short"])
    def test_a_malformed_observation_is_counted(self, lone: LoneRobot, row: bytes) -> None:
        """It causes no action."""
        lone.grant_body(0.0)
        lone.observe(0.1, 1, row=row)
        assert not lone.acted
        assert lone.node.telemetry.faults["refused observation"] == 1

    @pytest.mark.parametrize(
        ("reply", "line"),
        [
            (
                lambda digest: BodyDenied(digest, "full: all 4 slots are taken"),
                "no body from here: full",
            ),
            (
                lambda digest: BodyDenied(bytes(16), "full"),
                "arena here: it replies to another request",
            ),
        ],
        ids=["full", "to another request"],
    )
    def test_it_prints_why_it_has_no_body(
        self, lone: LoneRobot, reply: Callable[[bytes], BodyDenied], line: str
    ) -> None:
        """The arena is full, or its reply is malformed."""
        for _ in range(2):
            lone.robot.handle_event(4.0, ArenaOnline(ARENA_RUN))
            lone.reply(4.0, reply)
        lone.robot.handle_event(4.0, JoinReplyReceived(ME.id, b"noise"))
        assert not lone.robot.has_body
        assert any(printed.startswith(line) for printed in lone.lines)

    def test_waiting_for_a_body_is_published_and_is_no_fault(self, lone: LoneRobot) -> None:
        """Twice a second, with the arena's name, and printed once; until it has a body."""
        for now_s in np.arange(0.0, 60.0, 0.5).tolist():
            lone.robot.handle_timers(now_s)
        activities = [decode_activity(d) for t, d in lone.transport.telemetry if t == "activity"]
        assert len(activities) == 120
        assert {activity.doing for activity in activities} == {"waiting for arena here"}
        assert lone.lines == ["waiting for arena here"]
        assert not lone.node.telemetry.faults
        lone.grant_body(60.0)
        lone.robot.handle_timers(60.5)
        assert [topic for topic, _ in lone.transport.telemetry].count("activity") == 120

    def test_settings_of_the_arena_that_have_changed_are_printed(self, lone: LoneRobot) -> None:
        """After a restart of the arena, with both values; a reply that is malformed, or not the arena's, is a fault."""
        for run, packs in ((ARENA_RUN, 8), (ARENA_RUN + 1, 12)):
            lone.grant_body(0.0, arena_run=run)
            metadata = encode(ArenaMetadata("here", run, f'{{"arena":{{"packs":{packs}}}}}'))
            lone.deliver_metadata(0.1, metadata)
        assert lone.transport.metadata_requests == 2
        assert lone.lines[-1] == "arena here has other settings than before: arena.packs 8 → 12"
        lone.deliver_metadata(0.2, b"noise")
        lone.deliver_metadata(0.2, metadata, ME)
        assert lone.node.telemetry.faults["arena here"] == 2

    def test_it_returns_its_body(self, lone: LoneRobot) -> None:
        """When it stops."""
        lone.robot.release_body()
        assert not lone.transport.requests
        lone.grant_body(0.0)
        lone.robot.release_body()
        left = lone.requested[-1]
        assert isinstance(left, Leave)
        assert (left.robot, left.arena_run) == (ME.id, ARENA_RUN)


class TestPeers:
    def test_it_reconnects_if_a_robot_that_it_meets_is_not_online(self, lone: LoneRobot) -> None:
        """After 5 s of contacts, and not again for half a minute."""
        lone.grant_body(0.0)
        for tick in range(1, 300):
            lone.observe(0.1 * tick, tick, contact=Contact(PEER.id, tick))
        assert lone.reconnections == 1
        for tick in range(300, 420):
            lone.observe(0.1 * tick, tick, contact=Contact(PEER.id, tick))
        assert lone.reconnections == 2

    def test_it_reconnects_if_an_offline_robot_has_its_lamp_lit(self, lone: LoneRobot) -> None:
        """A dark lamp proves nothing; after a reconnection no peer is online yet."""
        lone.grant_body(0.0)
        other = seeded(COLONY, 1, 3).id
        for robot in (PEER.id, other):
            lone.robot.handle_event(0.0, RobotOnline(robot, 1, "theirs"))
        lone.robot.handle_event(0.1, RobotOffline(PEER.id, 1, "theirs"))
        lone.robot.handle_timers(0.2)
        assert lone.transport.is_scene_needed
        lone.deliver_scene(4.0, is_lit=True)
        lone.deliver_scene(5.2, is_lit=False)
        assert lone.reconnections == 0
        lone.deliver_scene(5.3, is_lit=True)
        assert lone.reconnections == 1
        assert not list(lone.node.peers)

    def test_it_does_not_suspect_a_robot_that_is_online_again(self, lone: LoneRobot) -> None:
        """It does not reconnect, and needs no scene."""
        lone.robot.handle_event(0.0, RobotOffline(PEER.id, 1, "theirs"))
        lone.robot.handle_event(1.0, RobotOnline(PEER.id, 2, "theirs"))
        lone.deliver_scene(9.0, is_lit=True)
        lone.robot.handle_timers(9.0)
        assert lone.reconnections == 0
        assert not lone.transport.is_scene_needed

    def test_a_robot_of_another_version_is_reported(self, lone: LoneRobot) -> None:
        """As one that it cannot mate with."""
        lone.robot.handle_event(0.0, IncompatiblePeer(PEER.id, 9))
        assert any("speaks version 9 of the protocol" in line for line in lone.lines)

    def test_an_older_process_with_its_key_stops_it(self, lone: LoneRobot) -> None:
        """It does not take that one's body, and stops once the older process has outlived a lease."""
        lone.robot.handle_event(0.0, RobotOnline(ME.id, 1, "older"))
        lone.robot.handle_timers(1.0)
        lone.robot.release_body()
        assert not lone.transport.requests
        with pytest.raises(DuplicateIdentityError, match="runs already in another process"):
            lone.robot.handle_timers(7.5)

    def test_next_s_is_when_a_timer_is_due(self, lone: LoneRobot) -> None:
        """It is never in the past once the timers are handled."""
        now_s = 0.0
        for _ in range(100):
            lone.robot.handle_timers(now_s)
            assert lone.robot.next_s > now_s
            now_s = lone.robot.next_s


def test_it_is_done_after_the_last_generation(lone: LoneRobot) -> None:
    """Of its config."""
    robot: Any = lone.robot
    assert not robot.is_done
    robot.node.robot.generation = 3
    assert robot.is_done
