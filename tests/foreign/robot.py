"""A robot written from PROTOCOL.md, as a process: `python -m tests.foreign.robot --help`.

One thread does everything: it takes what has arrived, one input after the other, and lets time pass between them.
"""

import argparse
import signal
import time
from pathlib import Path
from typing import Final

from tests.foreign.arena import Arena
from tests.foreign.driving import can_be_sensed, charge, driven
from tests.foreign.identity import id_of, stored_key
from tests.foreign.life import Agents
from tests.foreign.mating import Contact, Mating
from tests.foreign.messages import BODY_BYTES, ENVELOPE_BYTES, Message, RefusedError, decode, encode
from tests.foreign.network import (
    ArenaToken,
    BodyReply,
    EnvelopeArrived,
    Input,
    MetadataReply,
    Network,
    ObservationArrived,
    PeerToken,
    Question,
)
from tests.foreign.records import Records
from tests.foreign.species import Species, species
from tests.foreign.telemetry import opened, signed

STATE_S: Final = 0.5
DUPLICATE_S: Final = 7.0
ASK_AGAIN_S: Final = 1.0
REPLIES_PER_S: Final = 100.0
MOST_PEERS: Final = 1000
LINGER_S: Final = 3.0
NEVER: Final = 2**31
"""Control steps"""
MOST_LINES: Final = 20
"""Of what it refuses, however much that is."""


class DuplicateError(Exception):
    """Another process uses the key of this robot."""


class ForeignRobot:
    """The parts of the robot, and what connects them."""

    def __init__(self, options: argparse.Namespace, network_kind: type[Network] = Network) -> None:
        options.folder.mkdir(parents=True, exist_ok=True)
        self.is_stopped = False
        self.key = stored_key(options.folder / "key")
        self.id = id_of(bytes(self.key.verify_key))
        self.colony, self._states = options.colony, 0
        self.records = Records(options.folder / "foreign.sqlite")
        self.incarnation = self.records.next_incarnation()
        self.network = network_kind(options.connect, options.colony, options.arena, self.id)
        self._say(f"robot {self.id.hex()} of colony {options.colony}")
        who = self.id, options.colony, self.incarnation
        self.arena = Arena(options.arena, self.key, who, self.records, self.network.request_body)
        self.species = self._learn_species(options.species)
        self.agents = Agents(
            self.id, self.incarnation, self.records, self.species, self._publish_event
        )
        self.agents.lifetime_steps = options.lifetime_steps
        self.mating = Mating(
            self.key,
            options.colony,
            self.incarnation,
            self.species.digest,
            self.records,
            self.agents,
            self.network.send_envelope,
            time.monotonic(),
        )
        self._rest_steps, self._rest = options.rest_steps, 0
        """Control steps for which the beacon is off after a contact, and how many of them are left"""
        self._tokens: dict[bytes, set[tuple[int, str]]] = {}
        """Of each robot that is online, incarnation and session of its tokens"""
        self._duplicate_since_s: float | None = None
        self._refused = 0
        self._told_s = self._may_reply_s = self._period_s = 0.0

    def _learn_species(self, file: Path | None) -> Species:
        """From a file, its disk, or a robot of the colony: to mate, it must have the genes that they have."""
        stored = self.records.fact("schema")
        learned = (
            species(file.read_text()) if file else species(stored.decode()) if stored else None
        )
        while learned is None:
            self.network.ask_for_metadata()
            learned = self._species_of(self.network.get(ASK_AGAIN_S))
        with self.records.write():
            self.records.set_fact("schema", learned.lines.encode())
        self._say(f"species {learned.digest.hex()} of {len(learned.genes)} genes")
        return learned

    def _species_of(self, arrived: Input | None) -> Species | None:
        """What a robot replies; anybody may reply anything."""
        if not isinstance(arrived, MetadataReply):
            return None
        try:
            message, key = opened(arrived.payload, self.colony)
            metadata = decode(message, ENVELOPE_BYTES, "robot_metadata")
            return species(metadata[5]) if metadata[1] == id_of(key) else None
        except ValueError:
            return None

    def run(self) -> None:
        """Until it is stopped, and a moment longer if a mating is not over."""
        self.agents.begin()
        self.network.declare(self.incarnation)
        try:
            while not self.is_stopped:
                self._turn()
            self._rest = NEVER
            end_s = time.monotonic() + LINGER_S
            while not self.mating.is_idle and time.monotonic() < end_s:
                self._turn()
            self.arena.leave()
        finally:
            self.network.close()
            self.records.close()

    def _turn(self) -> None:
        arrived = self.network.get(0.02)
        now_s = time.monotonic()
        if arrived is not None:
            self._handle(arrived, now_s)
        self._pass_time(now_s)

    def _handle(self, arrived: Input, now_s: float) -> None:
        try:
            match arrived:
                case EnvelopeArrived(payload):
                    self.mating.receive(payload, now_s)
                case ObservationArrived(payload):
                    self._observe(payload, now_s)
                case BodyReply(payload):
                    self._say(self.arena.reply(payload, now_s))
                case PeerToken():
                    self._see_token(arrived, now_s)
                case ArenaToken(arena_run, session, is_online):
                    self.arena.token(arena_run, session, is_online)
                case Question(topic, payload, reply) if now_s >= self._may_reply_s:
                    self._may_reply_s = now_s + 1.0 / REPLIES_PER_S
                    reply(signed(encode(self._answer(topic, payload)), self.key, self.colony))
        except RefusedError as error:
            self._refused += 1
            if self._refused <= MOST_LINES:
                self._say(f"refused: {error}")

    def _pass_time(self, now_s: float) -> None:
        self.mating.pass_time(now_s)
        self.arena.pass_time(now_s)
        if now_s >= self._told_s + STATE_S:
            self._told_s = now_s
            self._states += 1
            count = self.incarnation * 2**32 + self._states
            state = signed(encode(self._state()), self.key, self.colony, count)
            self.network.publish("state", state)
        if self._duplicate_since_s is not None and now_s > self._duplicate_since_s + DUPLICATE_S:
            raise DuplicateError("another process uses the key of this robot")

    def _observe(self, payload: bytes, now_s: float) -> None:
        """One control period: what it feels, whom it meets, and what it does."""
        body = self.arena.body
        observation = body.observation(payload) if body else None
        if isinstance(observation, bytes):
            self.network.send_action(observation)
        if body is None or not isinstance(observation, list):
            return
        _, _, tick, row, contact = observation
        if not can_be_sensed(row):
            raise RefusedError("an observation beyond what a body can sense")
        self._period_s = self.arena.observed(now_s)
        agents = self.agents
        agents.step(tick, charge(row))
        self._rest = max(0, self._rest - 1)
        if contact is not None and self._rest == 0 and agents.wants_to_mate:
            self._rest = self._rest_steps
            agents.met(contact[0])
            self.mating.contact(
                contact[0], Contact(contact[1], tick, agents.agent, agents.genes), now_s
            )
        wants_to_mate = agents.wants_to_mate and self._rest == 0
        self.network.send_action(body.action(driven(row, wants_to_mate)))

    # Its peers and its observers.

    def _see_token(self, token: PeerToken, now_s: float) -> None:
        """A robot is online while it has a token: one that has just restarted has two."""
        robot, one = token.robot, (token.incarnation, token.session)
        tokens = self._tokens.setdefault(robot, set())
        (tokens.add if token.is_online else tokens.discard)(one)
        if not tokens:
            del self._tokens[robot]
        if robot == self.id:
            is_older = any(number < self.incarnation for number, _ in tokens)
            self._duplicate_since_s = (self._duplicate_since_s or now_s) if is_older else None
        elif token.is_online:
            self.mating.online(robot, now_s)
        elif not tokens:
            self.mating.offline(robot, now_s)

    def _answer(self, topic: str, payload: bytes) -> Message:
        if topic == "history":
            _, incarnation, first = decode(payload, BODY_BYTES, "history_request")
            return self.agents.history(incarnation, first)
        if payload:
            raise RefusedError("a query of metadata is empty")
        peers = [robot for robot in self._tokens if robot != self.id][:MOST_PEERS]
        return ["robot_metadata", self.id, self.incarnation, "{}", peers, self.species.lines]

    def _state(self) -> Message:
        agents, link = self.agents, self.arena.body.link if self.arena.body else None
        unresolved = [one for one in self.mating.open if one.record.state != "PROPOSED"]
        return [
            "state",
            self.id,
            link.slot if link else 0,
            self.arena.name if link else "",
            self.incarnation,
            agents.seq,
            int(1000 * time.time()),
            agents.tick,
            agents.generation,
            agents.agent,
            agents.energy,
            -1,  # it has no learning modules
            *self.records.counts(),
            agents.captures,
            self.records.pool(),
            len(unresolved),
            sum(one.is_in_doubt for one in unresolved),
            sum(one.record.is_orphaned for one in unresolved),
            len(self._tokens.keys() - {self.id}),
            self.mating.refused,
            self.network.dropped,
            self._refused,
            1000.0 * self._period_s,
        ]

    def _publish_event(self, event: bytes) -> None:
        self.network.publish("event", signed(event, self.key, self.colony))

    def _say(self, line: str) -> None:
        if line:
            print(line, flush=True)


def parser(description: str | None) -> argparse.ArgumentParser:
    options = argparse.ArgumentParser(description=description)
    options.add_argument("--folder", type=Path, required=True, help="for its key and its records")
    options.add_argument(
        "--connect", required=True, help="an endpoint of the colony, such as tcp/127.0.0.1:7447"
    )
    options.add_argument("--colony", default="colony")
    options.add_argument("--arena", default="arena")
    options.add_argument("--lifetime-steps", type=int, default=600)
    options.add_argument(
        "--species", type=Path, help="its genes, a line each; without it the colony is asked"
    )
    options.add_argument(
        "--rest-steps", type=int, default=25, help="for how long the beacon rests after a contact"
    )
    return options


def live(robot: ForeignRobot) -> None:
    """Until somebody ends the process."""

    def stop(_signal: int, _frame: object) -> None:
        robot.is_stopped = True

    signal.signal(signal.SIGTERM, stop)
    signal.signal(signal.SIGINT, stop)
    robot.run()


if __name__ == "__main__":
    live(ForeignRobot(parser(__doc__).parse_args()))
