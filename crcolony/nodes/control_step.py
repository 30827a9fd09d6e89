"""The control step of a robot with a body: an observation comes in, and an action goes out.

In lockstep the action waits until no mating can follow from the observation. Most observations have no consequence but
an action: on one machine they are answered without the rest of the process (`answer_quietly`).
"""

import math
from collections.abc import Callable

from crcolony.body.shared_pages import action_on
from crcolony.nodes.link_to_body import LinkToBody
from crcolony.nodes.robot_node import RobotNode
from crcolony.protocol.body_messages import Contact
from crcolony.protocol.codec import WireError
from crcolony.protocol.identity import RobotId
from crcolony.robot.paged_step import NOT_QUIET
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

    @property
    def can_answer_quietly(self) -> bool:
        """Whether it has a body on this machine, in lockstep, and the next observation may come.

        Not while a mating is open: the next action would have to wait for it.
        """
        body = self._body
        is_waited_for = self._local.page is not None and body.is_in_lockstep
        return is_waited_for and body.has_acted and self._node.is_settled

    def answer_quietly(self, wait: Callable[[], float | None]) -> bool:
        """Answer the observations of a body on this machine, in lockstep, for as long as nothing else happens.

        To be called while that `can_answer_quietly`. `wait` waits for the next one, and returns the time then, or None
        if anything else has happened. Return False if the latest one is left to `handle_observation`; raise as that
        does.
        """
        body, local, node = self._body, self._local, self._node
        page = local.page
        assert page is not None
        step, ring, tick, events = node.robot.step_on(page), local.ring, body.tick, 0
        while (now_s := wait()) is not None:
            events = step(tick + 1)
            if events:
                break
            ring()
            tick += 1
            self._note_time(now_s)
        if tick > body.tick:
            body.answer(tick, action_on(page, tick))
            body.has_acted, node.tick = True, tick
        if now_s is None or events == NOT_QUIET:
            return now_s is None
        self._note_time(now_s)
        body.answer(tick + 1, action_on(page, tick + 1))
        self._finish(now_s, None)
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
