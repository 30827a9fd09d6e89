"""A robot written from PROTOCOL.md alone, as a process: `python -m tests.foreign.robot --help`.

One thread does everything: it takes what has arrived, one input after the other, and lets time pass between them."""

import argparse
import signal
import time
from pathlib import Path
from typing import Final

from tests.foreign.body_link import Link, LinkedBody, Request, body_request, granted, leave_request
from tests.foreign.driving import charge, driven
from tests.foreign.identity import id_of, stored_key
from tests.foreign.life import Agents
from tests.foreign.mating import Mating
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

REQUEST_S: Final = 1.0
SILENCE_S: Final = 3.0
STATE_S: Final = 0.5
DUPLICATE_S: Final = 7.0
REPLIES_PER_S: Final = 100.0
MOST_PEERS: Final = 1000


class DuplicateError(Exception):
    """Another process uses the key of this robot."""


class ForeignRobot:
    """The parts of the robot, and what connects them."""

    def __init__(self, options: argparse.Namespace, network_kind: type[Network] = Network) -> None:
        options.folder.mkdir(parents=True, exist_ok=True)
        self.key = stored_key(options.folder / "key")
        self.id = id_of(bytes(self.key.verify_key))
        self.records = Records(options.folder / "foreign.sqlite")
        self.incarnation = self.records.next_incarnation()
        self.arena, self.colony, self._rest_steps = (
            options.arena,
            options.colony,
            options.rest_steps,
        )
        self.network = network_kind(options.connect, options.colony, options.arena, self.id)
        self.is_stopped = False
        self._runs: dict[tuple[int, str], None] = {}
        """Tokens of the arena: run and session, the newest last"""
        self._tokens: dict[bytes, set[tuple[int, str]]] = {}
        """Of each robot, incarnation and session of its tokens"""
        self._duplicate_since_s: float | None = None
        self._request: Request | None = None
        self._requests = 0
        self._body: LinkedBody | None = None
        self._rest = 0
        """Control steps for which the beacon stays off"""
        self._refused = self._faults = 0
        self._observed_s = self._requested_s = self._told_s = self._may_reply_at_s = 0.0
        self._period_ms = 0.0
        self.species: Species | None = (
            species(options.species.read_text()) if options.species else None
        )
        self.agents: Agents | None = None
        self.mating: Mating | None = None

    # Its life, from the first question to the last word.

    def run(self) -> None:
        print(
            f"robot {self.id.hex()} of colony {self.colony}, incarnation {self.incarnation}",
            flush=True,
        )
        self._learn_species()
        if self.is_stopped:
            self.network.close()
            return
        self.network.declare(self.incarnation)
        try:
            while not self.is_stopped:
                arrived = self.network.get(0.02)
                now_s = time.monotonic()
                if arrived is not None:
                    self._handle(arrived, now_s)
                self._pass_time(now_s)
            self._leave()
        finally:
            self.network.close()
            self.records.close()

    def _learn_species(self) -> None:
        """From its disk, or from a robot of the colony: to mate, it must have the genes that they have."""
        stored = self.records.fact("schema")
        if self.species is None and stored is not None:
            self.species = species(stored.decode())
        while self.species is None and not self.is_stopped:
            self.network.ask_for_metadata()
            arrived = self.network.get(REQUEST_S)
            if isinstance(arrived, MetadataReply):
                try:
                    schema = decode(arrived.payload, ENVELOPE_BYTES, "robot_metadata")[5]
                except RefusedError:
                    continue
                self.species = species(schema) if schema else None
        if self.species is None:
            return  # it was stopped
        with self.records.write():
            self.records.set_fact("schema", self.species.lines.encode())
        print(f"species {self.species.digest.hex()} of {len(self.species.genes)} genes", flush=True)
        self.agents = Agents(
            self.id,
            self.incarnation,
            self.records,
            self.species,
            lambda event: self.network.publish("event", event),
        )
        self.agents.begin()
        self.mating = Mating(
            self.key,
            self.colony,
            self.incarnation,
            self.species.digest,
            self.records,
            self.agents,
            self.network.send_envelope,
            time.monotonic(),
        )

    def _handle(self, arrived: Input, now_s: float) -> None:
        try:
            match arrived:
                case EnvelopeArrived(payload):
                    self._mating.receive(payload, now_s)
                case ObservationArrived(payload):
                    self._observe(payload, now_s)
                case BodyReply(payload):
                    self._take_body(payload, now_s)
                case PeerToken():
                    self._peer(arrived, now_s)
                case ArenaToken(arena_run, session, is_online):
                    self._arena(arena_run, session, is_online)
                case Question(topic, payload, reply) if now_s >= self._may_reply_at_s:
                    self._may_reply_at_s = now_s + 1.0 / REPLIES_PER_S
                    reply(encode(self._answer(topic, payload)))
        except RefusedError as error:
            self._faults += 1
            if self._faults <= 10:
                print(f"refused: {error}", flush=True)

    def _pass_time(self, now_s: float) -> None:
        self._mating.pass_time(now_s)
        has_body = self._body is not None and now_s < self._observed_s + SILENCE_S
        if self._runs and not has_body and now_s >= self._requested_s + REQUEST_S:
            self._request_body(now_s)
        if now_s >= self._told_s + STATE_S:
            self._told_s = now_s
            self._tell_state()
        if self._duplicate_since_s is not None and now_s > self._duplicate_since_s + DUPLICATE_S:
            raise DuplicateError("another process uses the key of this robot")

    @property
    def _mating(self) -> Mating:
        assert self.mating is not None
        return self.mating

    @property
    def _agents(self) -> Agents:
        assert self.agents is not None
        return self.agents

    # Its body.

    def _run_of_arena(self) -> int:
        return next(reversed(self._runs))[0]

    def _arena(self, arena_run: int, session: str, is_online: bool) -> None:
        if is_online:
            self._runs[arena_run, session] = None
            return
        self._runs.pop((arena_run, session), None)
        is_gone = all(arena_run != other for other, _ in self._runs)
        if is_gone and self._body is not None and self._body.link.arena_run == arena_run:
            self._body = None

    def _request_body(self, now_s: float) -> None:
        """The same request until it is answered: the reply may have been lost."""
        self._requested_s = now_s
        arena_run = self._run_of_arena()
        if self._request is None or self._request.arena_run != arena_run:
            self._requests += 1
            slot = -1 if self._body is None else self._body.link.slot
            message = [
                "join",
                self.id,
                self.colony,
                slot,
                arena_run,
                self.incarnation,
                self._requests,
            ]
            self._request = body_request(self.key, self.arena, message)
        self.network.request_body(self._request.envelope)

    def _take_body(self, payload: bytes, now_s: float) -> None:
        if self._request is None:
            return  # the reply to a request that is answered
        known = self.records.fact(f"arena {self.arena}")
        reply = granted(self._request, payload, self.arena, known)
        self._request = None
        if not isinstance(reply, Link):
            print(f"no body: {reply}", flush=True)
            return
        if known is None:
            with self.records.write():
                self.records.set_fact(f"arena {self.arena}", reply.arena_id)
        former = self._body
        self._body = LinkedBody(reply)
        if former is not None and former.link.arena_run == reply.arena_run:
            self._body.tick = former.tick
        self._observed_s = now_s
        print(f"has body {reply.slot}", flush=True)

    def _observe(self, payload: bytes, now_s: float) -> None:
        if self._body is None:
            return
        observation = self._body.observation(payload)
        if isinstance(observation, bytes):
            self.network.send_action(observation)
        if not isinstance(observation, list):
            return
        self._period_ms, self._observed_s = 1000.0 * (now_s - self._observed_s), now_s
        _, _, tick, row, contact = observation
        self._agents.step(tick, charge(row))
        self._rest = max(0, self._rest - 1)
        if contact is not None and self._rest == 0:
            self._meet(contact[0], contact[1], tick, now_s)
        wants_to_mate = self._agents.wants_to_mate and self._rest == 0
        self.network.send_action(self._body.action(driven(row, wants_to_mate)))

    def _meet(self, partner: bytes, nonce: int, tick: int, now_s: float) -> None:
        agents = self._agents
        if self._mating.contact(partner, nonce, tick, agents.agent, agents.genes, now_s):
            self._rest = self._rest_steps  # one contact, one mating: the beacon rests
            agents.met(partner)

    def _leave(self) -> None:
        if self._body is not None:
            self._requests += 1
            message = [
                "leave",
                self.id,
                self._body.link.arena_run,
                self.incarnation,
                self._requests,
            ]
            self.network.request_body(leave_request(self.key, self.arena, message))

    # Its peers and its observers.

    def _peer(self, token: PeerToken, now_s: float) -> None:
        """A robot is online while it has a token: a restarted one has two for a moment."""
        robot, one = token.robot, (token.incarnation, token.session)
        tokens = self._tokens.setdefault(robot, set())
        was_online = bool(tokens)
        (tokens.add if token.is_online else tokens.discard)(one)
        if not tokens:
            del self._tokens[robot]
        if robot == self.id:
            older = [t for t in tokens if t[0] < self.incarnation and t[1] != self.network.name]
            self._duplicate_since_s = (self._duplicate_since_s or now_s) if older else None
        elif token.is_online:
            self._mating.online(robot, now_s)
        elif was_online and not tokens:
            self._mating.offline(robot)

    def _answer(self, topic: str, payload: bytes) -> Message:
        if topic == "history":
            _, incarnation, first = decode(payload, BODY_BYTES, "history_request")
            return self._agents.history(incarnation, first)
        if payload:
            raise RefusedError("a query of metadata is empty")
        peers = [robot for robot in self._tokens if robot != self.id][:MOST_PEERS]
        assert self.species is not None
        return ["robot_metadata", self.id, self.incarnation, "{}", peers, self.species.lines]

    def _tell_state(self) -> None:
        agents, mating = self._agents, self._mating
        matings, conceptions = self.records.counts()
        unresolved = [open_ for open_ in mating.open.values() if open_.record.state != "PROPOSED"]
        doubts = sum(open_.is_in_doubt and open_.record.state == "PREPARED" for open_ in unresolved)
        orphaned = sum(open_.record.is_orphaned for open_ in unresolved)
        link = self._body.link if self._body else None
        place = [link.slot if link else 0, self.arena if link else ""]
        life = [
            agents.tick,
            agents.generation,
            agents.agent,
            agents.energy,
            -1,
            matings,
            conceptions,
        ]
        life += [agents.captures, self.records.pool(), len(unresolved), doubts, orphaned]
        peers = len(self._tokens) - (self.id in self._tokens)
        troubles = [mating.refused, self.network.dropped, self._faults, self._period_ms]
        unix_ms = int(1000 * time.time())
        state = [
            "state",
            self.id,
            *place,
            self.incarnation,
            agents.seq,
            unix_ms,
            *life,
            peers,
            *troubles,
        ]
        self.network.publish("state", encode(state))


def parser(description: str | None) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--folder", type=Path, required=True, help="for its key and its records")
    parser.add_argument(
        "--connect",
        required=True,
        help="a Zenoh endpoint of the colony, such as tcp/127.0.0.1:7447",
    )
    parser.add_argument("--colony", default="colony")
    parser.add_argument("--arena", default="arena")
    parser.add_argument(
        "--species", type=Path, help="its genes, a line each; without it the colony is asked"
    )
    parser.add_argument(
        "--rest-steps", type=int, default=25, help="how long the beacon rests after a contact"
    )
    return parser


def live(robot: ForeignRobot) -> None:
    def stop(_signal: int, _frame: object) -> None:
        robot.is_stopped = True

    signal.signal(signal.SIGTERM, stop)
    signal.signal(signal.SIGINT, stop)
    robot.run()


if __name__ == "__main__":
    live(ForeignRobot(parser(__doc__).parse_args()))
