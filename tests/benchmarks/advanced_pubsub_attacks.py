"""What a hostile peer, and a bad link, do in the trial of Zenoh's advanced publishers."""

import os
import socket
import threading
import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

import zenoh
import zenoh.ext
from zenoh.handlers import Callback

from crcolony.protocol.codec import encode
from crcolony.protocol.key_expressions import ROOT
from crcolony.protocol.telemetry_messages import EventMessage, HistoryReply, HistoryRequest
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import open_session
from tests.benchmarks.advanced_pubsub_robots import EVENT, KEYS, Kind, make_state, robot_name

FLOOD_PER_S = 10_000.0
FORGED_SEQ = 1_000_000
"""Numbers from here on are of forged events"""
HUGE = 2**30
SOURCES = 10_000
HELD, HELD_BYTES = 6_000, 60_000
VICTIM, OTHER = robot_name(0), robot_name(1)


class Attacker:
    """A peer without any key that reads all and publishes what it likes."""

    def __init__(self, endpoint: str) -> None:
        self.session = open_session(NetworkSettings(connect=(endpoint,)))
        self.keeps: list[Any] = []
        """Entities and queries that must live on"""
        self.latest: dict[str, zenoh.Sample] = {}
        self.keeps.append(
            self.session.declare_subscriber(
                KEYS.all_events, Callback(self._on_sample, indirect=False)
            )
        )

    def _on_sample(self, sample: zenoh.Sample) -> None:
        self.latest[str(sample.key_expr)] = sample

    def victim_source(self) -> zenoh.SourceInfo:
        """Wait for an event of the victim, and return what Zenoh says of its source."""
        while True:
            sample = self.latest.get(KEYS.event(VICTIM))
            if sample is not None and sample.source_info is not None:
                return sample.source_info
            time.sleep(0.01)

    def answer(self, key: str, reply: Callable[[zenoh.Query], None]) -> None:
        """Answer all queries on a key."""
        self.keeps.append(
            self.session.declare_queryable(key, Callback(reply, indirect=False), complete=True)
        )

    def stay_silent(self) -> None:
        """Keep every query of the colony open, and answer none."""
        self.answer(f"{ROOT}/**", self.keeps.append)
        self.answer(f"{ROOT}/colony/*/event/*/@adv/**", self.keeps.append)


def forged(robot: bytes, seq: int) -> bytes:
    """Return an event that a robot never published."""
    return encode(EventMessage(robot, 0, seq, int(1000 * time.time()), EVENT))


def forge_gap(peer: Attacker, kind: Kind) -> Callable[[], None]:
    """One event in the victim's name with a huge number."""
    if kind == "ours":
        peer.session.put(KEYS.event(VICTIM), forged(VICTIM, 2**50))
        peer.session.put(KEYS.state(VICTIM), encode(make_state(VICTIM, 0, 2**51)))
    else:
        of = peer.victim_source()
        peer.session.put(
            KEYS.event(VICTIM),
            forged(VICTIM, FORGED_SEQ),
            source_info=zenoh.SourceInfo(of.source_id, of.source_sn + HUGE),
        )
    return lambda: None


def forge_heartbeats(peer: Attacker, kind: Kind) -> Callable[[], None]:
    """States, or heartbeats, in the victim's name that announce events which do not exist."""
    if kind == "ours":
        data = encode(make_state(VICTIM, 0, 2**50))
        return lambda: peer.session.put(KEYS.state(VICTIM), data)
    of = peer.victim_source()
    key = f"{KEYS.event(VICTIM)}/@adv/pub/{of.source_id.zid}/{of.source_id.eid}/_"
    beat = zenoh.ext.z_serialize(zenoh.ext.UInt32(of.source_sn + HUGE))
    return lambda: peer.session.put(key, beat)


def flood(peer: Attacker, kind: Kind) -> Callable[[], None]:
    """Queries for all that the victim keeps."""
    key = KEYS.history(VICTIM) if kind == "ours" else f"{KEYS.event(VICTIM)}/@adv/**"
    request = encode(HistoryRequest(0, 1)) if kind == "ours" else b""

    ignore: Any = Callback(lambda _: None, indirect=False)

    def ask() -> None:
        peer.session.get(
            key,
            ignore,
            payload=request,
            timeout=0.5,
            consolidation=zenoh.ConsolidationMode.NONE,
        )

    return ask


def impersonate(peer: Attacker, kind: Kind) -> Callable[[], None]:
    """Answers to questions for the victim's past, with made-up events of the victim and of another robot."""
    made_up = [forged(robot, FORGED_SEQ + seq) for seq in range(10) for robot in (VICTIM, OTHER)]

    def reply(query: zenoh.Query) -> None:
        with query:
            if kind == "ours":
                query.reply(query.key_expr, encode(HistoryReply(0, 1, made_up)))
            else:
                for data in made_up[::2]:
                    query.reply(KEYS.event(VICTIM), data)
                for data in made_up[1::2]:
                    query.reply(KEYS.event(OTHER), data)

    own = KEYS.history(VICTIM) if kind == "ours" else f"{KEYS.event(VICTIM)}/@adv/**"
    peer.answer(own, reply)
    return lambda: None


def silence(peer: Attacker, kind: Kind) -> Callable[[], None]:
    """Queryables for everything that never answer, and tokens of publishers that do not exist."""
    peer.stay_silent()
    tokens: list[Any] = []

    def claim() -> None:
        live = peer.session.liveliness()
        tokens.append(live.declare_token(f"{KEYS.event(VICTIM)}/@adv/pub/nobody/{len(tokens)}/_"))

    return claim if kind == "zenoh" else lambda: None


def claim_incarnation(peer: Attacker, kind: Kind) -> Callable[[], None]:
    """A token that says that the victim has started again; `zenoh.ext` looks at no such token."""
    peer.keeps.append(peer.session.liveliness().declare_token(KEYS.alive(VICTIM, 7, "nobody")))
    return lambda: None


def make_up_sources(peer: Attacker, kind: Kind) -> Callable[[], None]:
    """Events of thousands of sources that do not exist, each with a gap."""
    for number in range(SOURCES):
        if kind == "ours":
            robot = os.urandom(16)
            for seq in (1, 1000):
                peer.session.put(KEYS.event(robot), forged(robot, seq))
        else:
            made = peer.session.declare_publisher(KEYS.event(VICTIM))
            for seq in (1, 1000):
                peer.session.put(
                    KEYS.event(VICTIM),
                    forged(VICTIM, FORGED_SEQ + seq),
                    source_info=zenoh.SourceInfo(made.id, seq),
                )
            made.undeclare()  # type: ignore[no-untyped-call]
        if number % 50 == 0:
            time.sleep(0.01)  # so that congestion drops none of them
    return lambda: None


def hold(peer: Attacker, kind: Kind) -> Callable[[], None]:
    """Large messages behind a gap that a silent queryable keeps open."""
    peer.stay_silent()
    time.sleep(0.3)
    data = bytes(HELD_BYTES)
    made = peer.session.declare_publisher(
        KEYS.event(VICTIM), congestion_control=zenoh.CongestionControl.BLOCK
    )
    for number in range(HELD):
        seq = 1 if number == 0 else 1000 + number
        made.put(data, source_info=zenoh.SourceInfo(made.id, seq) if kind == "zenoh" else None)
    return lambda: None


ATTACKS: dict[str, tuple[Callable[[Attacker, Kind], Callable[[], None]], float]] = {
    "forge_gap": (forge_gap, 1.0),
    "forge_heartbeats": (forge_heartbeats, 1_000.0),
    "flood": (flood, FLOOD_PER_S),
    "impersonate": (impersonate, 1.0),
    "silence": (silence, 1.0),
    "claim_incarnation": (claim_incarnation, 1.0),
    "make_up_sources": (make_up_sources, 1.0),
    "hold": (hold, 1.0),
}
"""Every attack, and how often a second it repeats what it returns"""


def run_attack(connection: Connection, name: str, kind: Kind, endpoint: str) -> None:
    """Attack until killed; send the number of shots whenever anything is received."""
    peer = Attacker(endpoint)
    make, per_s = ATTACKS[name]
    time.sleep(0.3)  # until the others know of it
    connection.send(os.getpid())
    connection.recv()
    shoot = make(peer, kind)
    connection.send("done")
    started_s, shots = time.monotonic(), 0
    while True:
        due = (time.monotonic() - started_s) * per_s
        while shots < due:
            shoot()
            shots += 1
            if shots % 100 == 0:
                due = min(due, (time.monotonic() - started_s) * per_s)
                if connection.poll(0.0):
                    break
        if connection.poll(0.005):
            connection.recv()
            connection.send(shots)


def run_proxy(connection: Connection, port: int, target: int, period_s: float) -> None:
    """Relay TCP connections, and cut them all once in every period."""
    server = socket.create_server(("127.0.0.1", port))
    links: list[socket.socket] = []

    def relay(source: socket.socket, sink: socket.socket) -> None:
        try:
            while data := source.recv(65536):
                sink.sendall(data)
        except OSError:
            pass
        for one in (source, sink):
            one.close()

    def cut() -> None:
        while True:
            time.sleep(period_s)
            while links:
                one = links.pop()
                try:
                    one.shutdown(socket.SHUT_RDWR)
                except OSError:
                    continue

    threading.Thread(target=cut, daemon=True).start()
    connection.send(os.getpid())
    while True:
        here, _ = server.accept()
        there = socket.create_connection(("127.0.0.1", target))
        links += [here, there]
        for pair in ((here, there), (there, here)):
            threading.Thread(target=relay, args=pair, daemon=True).start()
