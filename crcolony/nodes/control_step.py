"""The control step of a robot with a body: an observation comes in, and an action goes out.

In lockstep the action waits until no mating can follow from the observation. Most observations have no consequence but
an action: on one machine they are answered without the rest of the process (`answer_quietly`).
"""

import math
from collections.abc import Callable

from crcolony.body.contract import check_observation
from crcolony.nodes.link_to_body import LinkToBody
from crcolony.nodes.robot_node import RobotNode
from crcolony.protocol.body_messages import Contact
from crcolony.protocol.codec import WireError
from crcolony.protocol.identity import RobotId
from crcolony.transport.interface import LinkOnThisMachine, LocalObservation


class ControlStep:
    """Steps a `RobotNode` by the observations of its body.

    After `generations` it acts no more; 0: never. `on_contact` is called with every robot that it meets, before
    anything comes of that.
    """

    def __init__(
        self,
        node: RobotNode,
        body: LinkToBody,
        local: LinkOnThisMachine,
        generations: int,
        print_line: Callable[[str], None],
        on_contact: Callable[[float, RobotId], None],
    ) -> None:
        self._node, self._body, self._local = node, body, local
        self._generations, self._print_line = generations, print_line
        self._on_contact = on_contact
        self.observed_s = -math.inf
        """When the last observation, or the grant of the body, arrived"""

    @property
    def is_done(self) -> bool:
        """Whether the robot has completed its last generation."""
        return 0 < self._generations <= self._node.robot.generation

    def handle_observation(self, now_s: float, observation: bytes | LocalObservation) -> None:
        """Handle an observation, which may arrive again.

        Raises FatalStorageError when the state of the disk is unknown.
        """
        body = self._body
        try:
            sensed = body.sense(observation)
        except WireError as error:
            self._node.report_fault(f"refused observation: {error}")
            return
        if sensed is None:
            return
        tick, row, contact = sensed
        if tick > body.tick:
            self._note_time(now_s)
            body.answer(tick, self._node.robot.step(row))
            self._finish(now_s, contact)
        elif tick == body.tick and body.is_in_lockstep and body.has_acted:
            body.act()

    def answer_quietly(self, now_s: float) -> bool:
        """Answer the observation that follows on the last one, in lockstep on one machine, if it has no contact.

        Return False if it is not there, or not such a one; raises as `handle_observation` does.
        """
        body = self._body
        tick = body.tick + 1
        row = self._local.quiet_observation(tick)
        if row is None or not body.has_acted or not body.is_in_lockstep:
            return False
        try:
            check_observation(row)
        except ValueError:
            return False
        self._note_time(now_s)
        robot = self._node.robot
        body.answer(tick, robot.step(row))
        if robot.events:
            self._finish(now_s, None)
        else:
            self._node.tick = tick
            body.act()
        return True

    def act_if_settled(self) -> None:
        """Publish the action, and advance the slice; in lockstep only when no mating is open."""
        body, node = self._body, self._node
        if not body.can_act or (body.is_in_lockstep and not node.is_settled):
            return
        generation = node.robot.generation
        body.has_acted = True
        if node.robot.events:
            node.advance_slice()
        if not self.is_done:
            body.act()
        if node.robot.generation > generation:
            self._print_line(f"generation {node.robot.generation}, {node.matings} matings so far")

    def _finish(self, now_s: float, contact: Contact | None) -> None:
        """Do what follows from the step that was made."""
        if contact is not None:
            self._on_contact(now_s, contact.robot)
        self._node.handle_step_events(now_s, self._body.tick, contact)
        self.act_if_settled()

    def _note_time(self, now_s: float) -> None:
        self._node.period_ms = min(1000.0 * (now_s - self.observed_s), 1e9)
        self.observed_s = now_s
