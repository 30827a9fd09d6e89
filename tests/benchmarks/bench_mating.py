"""How long a mating takes, from the contact until both robots have decided, on disk, in two processes over Zenoh.

Run with `make bench`, or `python -m tests.benchmarks.bench_mating`. The baseline is what the protocol cannot do
without, of the same sizes, measured in turns with the matings: between two other processes bare Zenoh messages and bare
durable commits of SQLite, in the order of a mating (propose; prepare, accept; decide, commit; decide). What signatures
cost is printed beside it: three messages are signed and verified until both have decided. Printed, too, are the same
round trips and commits each by itself, many in a row, which take less time: disk, link and caches are warm then.
"""

import contextlib
import itertools
import statistics
import tempfile
import time
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection
from pathlib import Path

from crcolony.config import Config
from crcolony.nodes.node_inputs import ColonyMember, NodeResources
from crcolony.nodes.robot_node import RobotNode
from crcolony.protocol.body_messages import Contact
from crcolony.protocol.encounters import EncounterRecord
from crcolony.protocol.envelope import sign_message
from crcolony.protocol.identity import Identity
from crcolony.protocol.mating_messages import Accept, Commit, Done, Encounter, Propose, pack_genes
from crcolony.robot.factory import make_robots, own_streams
from crcolony.robot.genes import agent_schema
from crcolony.robot.state import MET
from crcolony.storage.rows import Decision
from crcolony.storage.store import RobotStore
from crcolony.transport.inbox import Inbox
from crcolony.transport.interface import EnvelopeReceived, RobotOnline
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_robots import RobotTransport
from crcolony.transport.zenoh_session import open_session
from tests.benchmarks.bare_mating import (
    Sizes,
    bare_matings_between,
    commits_into,
    round_trips_between,
    signatures_of,
)
from tests.benchmarks.processes import ARENA, COLONY, child, here

TURNS = 300
NAMES = 300
"""Bytes of an encounter that are neither message nor genes."""
TARGET = 1.5


class TimedStore(RobotStore):
    """A store that notes when a decision is on the disk."""

    decided_s = 0.0

    def write(
        self,
        records: Sequence[EncounterRecord],
        decided: EncounterRecord | None = None,
        decision: Decision | None = None,
    ) -> None:
        """See `RobotStore`."""
        super().write(records, decided, decision)
        if decision is not None:
            self.decided_s = time.monotonic()


class Partner:
    """A robot of the product, whose contacts the benchmark reports."""

    def __init__(self, identity: Identity, network: NetworkSettings, folder: Path) -> None:
        config = Config()
        batch, _, (robot,) = make_robots(config, [identity.id.hex()], own_streams([identity.id]))
        robot.start()
        self.inbox = Inbox()
        self.session = open_session(network)
        self.store = TimedStore(
            folder / "memory", identity.id, bytes.fromhex(robot.subpopulation.schema.digest)
        )
        incarnation = self.store.begin_incarnation(1)
        self.transport = RobotTransport(self.session, COLONY, ARENA, self.inbox.deliver)
        member = ColonyMember(identity, COLONY, 0, incarnation)
        resources = NodeResources(self.store, self.transport, time.time)
        self.node = RobotNode(member, robot, batch, resources)
        self.tick = 0
        self._events = batch.events[robot.row : robot.row + 1]

    def meet(self, contact: Contact) -> None:
        """Report a contact, as the own body would."""
        self.tick += 1
        self._events[0] = MET
        self.node.handle_step_events(time.monotonic(), self.tick, contact)

    def mate(self) -> float:
        """Wait until a mating is decided and nothing is open any more; return when it was decided."""
        self.store.decided_s = 0.0
        while not self.store.decided_s or self.node.waiting:
            self.handle_next()
        return self.store.decided_s

    def handle_next(self) -> None:
        """Wait for one event and handle it."""
        event = self.inbox.get(min(0.5, max(0.0, self.node.next_s - time.monotonic())))
        if isinstance(event, EnvelopeReceived):
            self.node.handle_envelope(time.monotonic(), event.envelope)
        elif isinstance(event, RobotOnline):
            self.node.handle_peer_online(
                time.monotonic(), event.robot, event.incarnation, event.session
            )
        self.node.handle_timeouts(time.monotonic())


def live(
    connection: Connection, seed: bytes, peer: bytes, network: NetworkSettings, folder: Path
) -> None:
    """Mate whenever the connection asks; answer with the times of the contact and of the decision."""
    partner = Partner(Identity(seed), network, folder)
    partner.node.start(time.monotonic())
    partner.transport.add_robot(partner.node.id, partner.node.incarnation)
    try:
        while peer not in partner.node.peers:
            partner.handle_next()
        connection.send("ready")
        while True:
            nonce: int = connection.recv()
            if partner.node.id > peer:  # the one that answers has met before it is proposed to
                partner.meet(Contact(peer, nonce))
                connection.send("met")
                connection.send(partner.mate())
            else:
                start_s = time.monotonic()
                partner.meet(Contact(peer, nonce))
                connection.send((start_s, partner.mate()))
    finally:
        partner.session.close()  # type: ignore[no-untyped-call]


def matings_between(
    opened: contextlib.ExitStack, endpoint: str, folder: Path
) -> Callable[[], float]:
    """Return a function that lets two robots mate once and returns how long that took, in seconds."""
    seeds = sorted((bytes([k]) * 32 for k in (1, 2)), key=lambda seed: Identity(seed).id)
    ids = [Identity(seed).id for seed in seeds]
    networks = NetworkSettings(listen=(endpoint,)), NetworkSettings(connect=(endpoint,))
    folders = [folder / "a", folder / "b"]
    for each in folders:
        each.mkdir()
    initiator, responder = (
        opened.enter_context(child(live, seeds[k], ids[1 - k], networks[k], folders[k]))
        for k in (0, 1)
    )
    assert (initiator.recv(), responder.recv()) == ("ready", "ready")
    nonces = itertools.count()

    def mate() -> float:
        nonce = next(nonces)
        responder.send(nonce)
        responder.recv()
        initiator.send(nonce)
        start_s, decided_s = initiator.recv()
        return float(max(decided_s, responder.recv()) - start_s)

    return mate


def envelopes() -> list[bytes]:
    """Return the envelopes of a mating, as long as the product's."""
    me, peer = Identity(bytes(32)), Identity(bytes([1]) * 32)
    _, _, (robot,) = make_robots(Config(), [me.id.hex()], own_streams([me.id]))
    robot.start()
    own = robot.mating_offer()
    genes, schema = pack_genes(own.genes), bytes.fromhex(robot.subpopulation.schema.digest)
    encounter = Encounter(me.id, peer.id, int(time.time()), 1000)
    return [
        sign_message(message, COLONY, sender)
        for message, sender in (
            (Propose(encounter, 2**40, schema, own.agent, genes), me),
            (Accept(encounter, 2**40, schema, own.agent, genes), peer),
            (Commit(encounter), me),
            (Done(encounter), peer),
        )
    ]


def main() -> None:
    sealed = envelopes()
    propose, accept, commit, done = map(len, sealed)
    genes = 8 * len(agent_schema(Config().learning, Config().heredity))
    prepared = propose + 2 * genes + NAMES
    sizes = Sizes(propose, accept, commit, done, prepared, prepared + genes)
    times: list[list[float]] = [[], [], [], [], []]
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as opened:
        runs = (
            matings_between(opened, here(), Path(folder)),
            bare_matings_between(opened, here(), Path(folder), sizes),
            round_trips_between(opened, here(), sizes),
            commits_into(opened, Path(folder), sizes),
            signatures_of(sealed),
        )
        for _ in range(TURNS):
            for run, own in zip(runs, times, strict=True):
                own.append(run())
    mating, bare, trips, commits, signatures = (
        1e6 * statistics.median(own[TURNS // 10 :]) for own in times
    )
    print(
        f"contact to both decided: {mating:.0f} us; bare messages and commits in the same order:"
        f" {bare:.0f} us; three signatures, made and verified: {signatures:.0f} us;"
        f" ratio {mating / bare:.2f}, with signatures {mating / (bare + signatures):.2f}  (target {TARGET})"
    )
    apart = trips + commits
    print(
        f"each by itself: two round trips {trips:.0f} us, three durable commits {commits:.0f} us;"
        f" ratio {mating / apart:.2f}, with signatures {mating / (apart + signatures):.2f}"
    )


if __name__ == "__main__":
    main()
