"""An arena on the network: it publishes observations and scenes, handles what arrives, and saves a checkpoint."""

import time
from collections.abc import Callable, Iterable
from pathlib import Path

from crcolony.body_server.body_server import BodyServer
from crcolony.durable_files import replace_file
from crcolony.nodes.arena_node import ArenaNode
from crcolony.protocol.identity import Identity, RobotId
from crcolony.runtime.local_robots import accept_local_robots
from crcolony.storage.checkpoint import CheckpointError, read_checkpoint, write_checkpoint
from crcolony.storage.files import FolderError
from crcolony.transport.inbox import Inbox
from crcolony.transport.interface import InboundEvent
from crcolony.transport.zenoh_arena import ArenaTransport

_SCENE_PERIOD_S = 0.1
_REMOVAL_PERIOD_S = 0.5
"""How often the bodies of absent robots are removed."""
_SAVE_PERIOD_S = 10.0


class NetworkedArena:
    """An `ArenaNode` with its transport and its checkpoint; `name` is its name on the network, `identity` its key."""

    def __init__(
        self,
        node: ArenaNode,
        name: str,
        identity: Identity,
        transport: ArenaTransport,
        checkpoint: Path | None,
        print_line: Callable[[str], None],
    ) -> None:
        self.node, self.name = node, name
        self._transport, self._checkpoint, self._print_line = transport, checkpoint, print_line
        self._server = BodyServer(node, identity, transport.remove_robot, print_line, name)
        self._scenes = 0
        now_s = time.monotonic()
        self._scene_due_s = self._removal_due_s = now_s
        self._save_due_s = now_s + _SAVE_PERIOD_S

    def handle_event(self, event: InboundEvent) -> None:
        """Handle an inbound event."""
        self._server.handle_event(time.monotonic(), event)

    def accept_local_robots(self, inbox: Inbox) -> None:
        """Share memory with the robots on this machine, where that is possible."""
        accept_local_robots(
            self._server,
            self.node,
            inbox,
            self._transport.publish_observation,
            lambda: self.node.take_actions(self._server.local_robots.pages),
        )

    def close(self) -> None:
        """Share memory with nobody any more."""
        self._server.local_robots.close()

    def publish_tick(self, robots: Iterable[RobotId]) -> None:
        """Publish the observations of a new tick, to these robots and to those on this machine."""
        local = self._server.local_robots
        if local:
            self.node.write_observations(local.pages)
            local.ring_all()
            robots = [robot for robot in robots if robot not in local]
        self.publish_observations(robots)

    def publish_observations(self, robots: Iterable[RobotId]) -> None:
        """Publish the present observations of these robots' bodies."""
        self._server.publish_observations(robots, self._transport.publish_observation)

    def handle_timers(self, now_s: float) -> None:
        """Publish the scene, remove absent robots and save, each when it is due."""
        if now_s >= self._scene_due_s:
            self._scene_due_s = now_s + _SCENE_PERIOD_S
            self._scenes += 1
            scene = self.node.scene(self.name, self._scenes, int(1000.0 * time.time()))
            self._transport.publish_scene(self._server.sign(scene))
        if now_s >= self._removal_due_s:
            self._removal_due_s = now_s + _REMOVAL_PERIOD_S
            self._server.remove_absent(now_s)
        if now_s >= self._save_due_s:
            self._save_due_s = now_s + _SAVE_PERIOD_S
            self.save()

    def save(self) -> None:
        """Write the checkpoint, if there is one; print why if that fails."""
        if self._checkpoint is None:
            return
        try:
            replace_file(self._checkpoint, lambda file: write_checkpoint(file, self.node.save()))
        except OSError as error:
            self._print_line(f"{self._checkpoint}: not saved: {error.strerror}")


def restore_arena(node: ArenaNode, checkpoint: Path) -> bool:
    """Restore an arena from a checkpoint with all robots offline; return whether there is one.

    Raises FolderError if it is damaged or of other settings.
    """
    try:
        node.restore(read_checkpoint(checkpoint))
    except FileNotFoundError:
        return False
    except (CheckpointError, IndexError, KeyError, TypeError, ValueError) as error:
        raise FolderError(f"{checkpoint}: cannot resume from it: {error}") from None
    now_s = time.monotonic()
    for robot in node.robots:
        node.mark_offline(robot, now_s)
    return True
