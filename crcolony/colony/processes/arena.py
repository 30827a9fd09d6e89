"""The process of an arena: nature for the bodies in it. It reports what happens and selects nobody.

Real time: a tick at every period of the wall clock, and nobody is waited for. Lockstep: a tick as soon as every robot
that is alive has acted on the one before.
"""

import time
from collections.abc import Callable, Iterable
from pathlib import Path

from crcolony.colony import telemetry
from crcolony.colony.arena_node import ArenaNode
from crcolony.colony.checkpoint import CheckpointError, read_checkpoint, write_checkpoint
from crcolony.colony.exchanges import Bucket
from crcolony.colony.identity import RobotId
from crcolony.colony.inbox import Inbox
from crcolony.colony.messages import Leave, Refused, WireError, decode_action, decode_join, encode
from crcolony.colony.results import ResultsError, replace_file
from crcolony.colony.transport import Acted, Arrival, Asked, RobotGone, RobotSeen
from crcolony.colony.zenoh_transport import ArenaTransport

_SCENE_PERIOD_S = 0.1
_REPEAT_S = 0.5
"""In lockstep a robot that does not answer is told again after this."""
_SAVE_PERIOD_S = 10.0
_HOUSEKEEPING_S = 0.5
_LINES_PER_S = 100.0
_MOST_REFUSED = 1000


class ArenaProcess:
    """Carries an `ArenaNode` on the network, by the clock or in lockstep.

    `wall_period_s` is the time between two ticks of real time; None means lockstep.
    """

    def __init__(
        self,
        node: ArenaNode,
        name: str,
        transport: ArenaTransport,
        inbox: Inbox,
        wall_period_s: float | None,
        checkpoint: Path | None,
        say: Callable[[str], None],
    ) -> None:
        self._node, self._name = node, name
        self._transport, self._inbox = transport, inbox
        self._wall_period_s = wall_period_s
        self._checkpoint = checkpoint
        self._say = say
        self._lines = Bucket(_LINES_PER_S)
        self._scenes = 0
        self._refused: dict[RobotId, None] = {}
        """Who was told, so that it is said once"""
        self._sessions: dict[RobotId, set[str]] = {}
        """Where every robot is on the network"""
        now_s = time.monotonic()
        self._scene_due_s = self._housekeeping_due_s = now_s
        self._save_due_s = now_s + _SAVE_PERIOD_S

    def run(self, is_stopped: Callable[[], bool]) -> None:
        """Let ticks pass until told to stop; the world is saved then."""
        if self._wall_period_s is None:
            self._run_in_lockstep(is_stopped)
        else:
            self._run_by_the_clock(is_stopped, self._wall_period_s)
        self._save()

    def _run_in_lockstep(self, is_stopped: Callable[[], bool]) -> None:
        while not is_stopped():
            repeat_s = time.monotonic() + _REPEAT_S
            while not self._node.is_ready and not is_stopped():
                arrival = self._inbox.get(_REPEAT_S)
                if arrival is not None:
                    self._take(arrival)
                now_s = time.monotonic()
                if now_s >= repeat_s:
                    repeat_s = now_s + _REPEAT_S
                    self._observe(self._node.waiting_for)
                self._keep_house(now_s)
            if not is_stopped():
                self._advance()
                self._keep_house(time.monotonic())

    def _run_by_the_clock(self, is_stopped: Callable[[], bool], period_s: float) -> None:
        due_s = time.monotonic() + period_s
        while not is_stopped():
            now_s = time.monotonic()
            while now_s < due_s and not is_stopped():
                arrival = self._inbox.get(due_s - now_s)
                if arrival is not None:
                    self._take(arrival)
                now_s = time.monotonic()
            self._advance()
            due_s += period_s
            if now_s > due_s:  # this machine was asleep: time that is lost is not made up for
                due_s = now_s + period_s
            self._keep_house(now_s)

    def _advance(self) -> None:
        self._node.advance()
        self._observe(self._node.robots)

    def _observe(self, robots: Iterable[RobotId]) -> None:
        for robot in robots:
            self._transport.observe(robot, self._node.observation(robot))

    # What arrives ----------------------------------------------------------------------------------------------

    def _take(self, arrival: Arrival) -> None:
        match arrival:
            case Acted(robot=robot, action=data):
                try:
                    self._node.act(robot, decode_action(data))
                except WireError:
                    self._node.counts["malformed"] += 1
            case Asked(about="join", question=question, answer=answer):
                self._admit(question, answer)
            case RobotSeen(robot=robot, session=session):
                self._sessions.setdefault(robot, set()).add(session)
                self._node.find(robot)
            case RobotGone(robot=robot, session=session):
                sessions = self._sessions.get(robot, set())
                sessions.discard(session)
                if not sessions:
                    self._sessions.pop(robot, None)
                    self._node.lose(robot, time.monotonic())

    def _admit(self, question: bytes, answer: Callable[[bytes], None]) -> None:
        node = self._node
        try:
            request = decode_join(question)
        except WireError as error:
            node.counts["malformed"] += 1
            self._say_of_strangers(f"malformed request for a body: {error}")
            return
        if isinstance(request, Leave):
            if request.robot in node.robots:
                self._say_of_strangers(
                    f"robot {request.robot.hex()[:8]} leaves place {node.robots[request.robot]}"
                )
                node.leave(request.robot)
                self._transport.forget(request.robot)
            return
        is_new = request.robot not in node.robots
        reply = node.join(request)
        answer(encode(reply))
        name = f"robot {request.robot.hex()[:8]} of colony {request.colony}"
        if request.robot not in node.robots:
            if isinstance(reply, Refused) and request.robot not in self._refused:
                self._refused[request.robot] = None
                self._say_of_strangers(f"{name} gets no place: {reply.reason}")
                if len(self._refused) > _MOST_REFUSED:
                    self._refused.clear()
            return
        if request.robot not in self._sessions:
            node.lose(request.robot, time.monotonic())  # until it is on the network
        if is_new:
            self._say_of_strangers(f"{name} gets place {node.robots[request.robot]}")

    def _say_of_strangers(self, line: str) -> None:
        """Say what anybody can make an arena say, but not without end."""
        if self._lines.take(time.monotonic()):
            self._say(line)

    # Now and then ----------------------------------------------------------------------------------------------

    def _keep_house(self, now_s: float) -> None:
        if now_s >= self._scene_due_s:
            self._scene_due_s = now_s + _SCENE_PERIOD_S
            self._scenes += 1
            self._transport.show(encode(self._scene()))
        if now_s >= self._housekeeping_due_s:
            self._housekeeping_due_s = now_s + _HOUSEKEEPING_S
            for robot in self._node.forget_lost(now_s):
                self._say(f"robot {robot.hex()[:8]} did not come back; its body is removed")
                self._transport.forget(robot)
        if now_s >= self._save_due_s:
            self._save_due_s = now_s + _SAVE_PERIOD_S
            self._save()

    def _scene(self) -> telemetry.Scene:
        unix_ms = int(1000.0 * time.time())
        return self._node.scene(self._name, self._scenes, unix_ms)

    def _save(self) -> None:
        if self._checkpoint is None:
            return
        try:
            replace_file(self._checkpoint, lambda file: write_checkpoint(file, self._node.save()))
        except OSError as error:
            self._say(f"{self._checkpoint}: not saved: {error.strerror}")


def restore_arena(node: ArenaNode, checkpoint: Path) -> bool:
    """Go on with a saved world, if there is one, in which everybody is yet to come back.

    Raises ResultsError if it is damaged or of other settings.
    """
    try:
        node.restore(read_checkpoint(checkpoint))
    except FileNotFoundError:
        return False
    except (CheckpointError, IndexError, KeyError, TypeError, ValueError) as error:
        raise ResultsError(f"{checkpoint}: cannot go on from it: {error}") from None
    now_s = time.monotonic()
    for robot in node.robots:
        node.lose(robot, now_s)
    return True
