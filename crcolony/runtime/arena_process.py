"""The process of an arena: nature for the bodies in it. It reports what happens and selects nobody.

Real time: a tick at every period of the wall clock, and nobody is waited for. Lockstep: a tick as soon as every robot
that is alive has acted on the one before.
"""

import time
from collections.abc import Callable, Iterable
from pathlib import Path

from crcolony.nodes.arena_node import ArenaNode
from crcolony.nodes.arena_server import ArenaServer
from crcolony.protocol.codec import encode
from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import Scene
from crcolony.storage.checkpoint import CheckpointError, read_checkpoint, write_checkpoint
from crcolony.storage.files import FolderError, replace_file
from crcolony.transport.inbox import Inbox
from crcolony.transport.interface import InboundEvent
from crcolony.transport.zenoh_arena import ArenaTransport

_SCENE_PERIOD_S = 0.1
_REPEAT_S = 0.5
"""In lockstep a robot that does not answer is told again after this."""
_SAVE_PERIOD_S = 10.0
_HOUSEKEEPING_S = 0.5


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
        print_line: Callable[[str], None],
    ) -> None:
        self._node, self._name = node, name
        self._transport, self._inbox = transport, inbox
        self._wall_period_s = wall_period_s
        self._checkpoint = checkpoint
        self._print_line = print_line
        self._server = ArenaServer(node, transport.remove_robot, print_line, name)
        self._scenes = 0
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
                event = self._inbox.get(_REPEAT_S)
                if event is not None:
                    self._take(event)
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
                event = self._inbox.get(due_s - now_s)
                if event is not None:
                    self._take(event)
                now_s = time.monotonic()
            self._advance()
            due_s += period_s
            if now_s > due_s:  # this machine was asleep: time that is lost is not made up for
                due_s = now_s + period_s
            self._keep_house(now_s)

    def _advance(self) -> None:
        self._node.step()
        self._observe(self._node.robots)

    def _observe(self, robots: Iterable[RobotId]) -> None:
        for robot in robots:
            self._transport.publish_observation(robot, self._node.observation(robot))

    def _take(self, event: InboundEvent) -> None:
        self._server.handle_event(time.monotonic(), event)

    # Now and then ----------------------------------------------------------------------------------------------

    def _keep_house(self, now_s: float) -> None:
        if now_s >= self._scene_due_s:
            self._scene_due_s = now_s + _SCENE_PERIOD_S
            self._scenes += 1
            self._transport.publish_scene(encode(self._scene()))
        if now_s >= self._housekeeping_due_s:
            self._housekeeping_due_s = now_s + _HOUSEKEEPING_S
            self._server.remove_absent(now_s)
        if now_s >= self._save_due_s:
            self._save_due_s = now_s + _SAVE_PERIOD_S
            self._save()

    def _scene(self) -> Scene:
        unix_ms = int(1000.0 * time.time())
        return self._node.scene(self._name, self._scenes, unix_ms)

    def _save(self) -> None:
        if self._checkpoint is None:
            return
        try:
            replace_file(self._checkpoint, lambda file: write_checkpoint(file, self._node.save()))
        except OSError as error:
            self._print_line(f"{self._checkpoint}: not saved: {error.strerror}")


def restore_arena(node: ArenaNode, checkpoint: Path) -> bool:
    """Go on with a saved world, if there is one, in which everybody is yet to come back.

    Raises FolderError if it is damaged or of other settings.
    """
    try:
        node.restore(read_checkpoint(checkpoint))
    except FileNotFoundError:
        return False
    except (CheckpointError, IndexError, KeyError, TypeError, ValueError) as error:
        raise FolderError(f"{checkpoint}: cannot go on from it: {error}") from None
    now_s = time.monotonic()
    for robot in node.robots:
        node.mark_offline(robot, now_s)
    return True
