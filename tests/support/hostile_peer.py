"""A hostile peer: a process that sends raw bytes to a colony, one attack at a time, until it is killed.

It has no key of any robot and no body, but it receives all messages: it records envelopes and nonces, and knows the
robots' public keys and the protocol. It prints `attacking` once it does.
"""

import argparse
import itertools
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from crcolony.body.contract import OBSERVATION_WIDTH
from crcolony.protocol.body_messages import Observation, pack_row
from crcolony.protocol.codec import MAX_ENVELOPE_BYTES, encode
from crcolony.protocol.envelope import sign_message
from crcolony.protocol.identity import Identity, load_key
from crcolony.protocol.link_keys import CODE_BYTES
from crcolony.protocol.mating_messages import Accept, Commit, MatingMessage, Propose
from crcolony.protocol.signed_envelope import SignedEnvelope
from crcolony.protocol.telemetry_messages import HistoryRequest, RobotState
from tests.support.hostile_bodies import BODY_ATTACKS
from tests.support.hostile_session import ARENA, COLONY, DIGEST, Attacks, Hostile, Insider
from tests.support.linked_robot import forged_join

BURSTS_PER_S = 100.0
"""How many times a second an attack sends what is due."""
MADE_UP = 2_000
"""Robots whose keys a flood uses."""
UNFIT = (float("nan"), float("inf"), -float("inf"), 1e300, -1e-310, -1.0)
"""Values that no gene may have."""

# The attacks --------------------------------------------------------------------------------------------------------


def oversized(peer: Hostile) -> Callable[[], None]:
    """Envelopes, observations and queries from one byte too long up to what Zenoh itself refuses."""
    sizes = (MAX_ENVELOPE_BYTES + 1, 200_000, 500_000, 2_000_000)
    contents = [peer.chance.randbytes(size) for size in sizes]

    def shoot() -> None:
        robot, content = peer.victim(), peer.chance.choice(contents)
        peer.post(content, robot)
        peer.put(peer.arena.observation(robot), content)
        peer.query(peer.colony.history(robot), content)

    return shoot


def malformed(peer: Hostile) -> Callable[[], None]:
    """Noise, and genuine envelopes with bits flipped, truncated, or extended."""

    def shoot() -> None:
        chance = peer.chance
        _, envelope, _ = peer.envelope()
        data = bytearray(envelope)
        kind = chance.randrange(4)
        if kind == 0:
            data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
        elif kind == 1:
            del data[chance.randrange(len(data)) :]
        elif kind == 2:
            data += chance.randbytes(chance.randrange(1, 50))
        else:
            data = bytearray(b"\x93" + chance.randbytes(chance.randrange(200)))
        peer.post(bytes(data))

    return shoot


def unfit(peer: Hostile) -> Callable[[], None]:
    """Genes that are NaN, out of range, too many or too few, validly signed by a robot that was never met."""

    def shoot() -> None:
        genes = peer.genes()
        genes[peer.chance.randrange(genes.size)] = peer.chance.choice(UNFIT)
        packed = genes.tobytes()[: peer.chance.choice((None, 8, -8))] * peer.chance.choice(
            (1, 1, 3)
        )
        robot = peer.victim()
        peer.post(sign_message(peer.proposal(peer.me.id, robot, packed), COLONY, peer.me), robot)

    return shoot


def impostor(peer: Hostile) -> Callable[[], None]:
    """Envelopes in an honest robot's name: with a key of its own, and with the robot's key and an invalid signature."""

    def shoot() -> None:
        robot = peer.victim()
        other = peer.peer_of(robot)
        envelopes: list[MatingMessage] = [peer.proposal(other, robot, peer.genes().tobytes())]
        _, _, sent = peer.recorded[-1]
        if isinstance(sent, Propose):  # replies before its receiver does
            envelopes += [
                Accept(sent.encounter, sent.nonce, DIGEST, "hostile/1", sent.genes),
                Commit(sent.encounter),
            ]
        for message in envelopes:
            encounter = message.encounter
            is_answer = isinstance(message, Accept)
            to = encounter.initiator if is_answer else encounter.responder
            by = encounter.responder if is_answer else encounter.initiator
            peer.post(sign_message(message, COLONY, peer.me), to)
            signature = peer.chance.randbytes(64)
            peer.post(encode(SignedEnvelope(encode(message), peer.keys[by], signature)), to)

    return shoot


def replay(peer: Hostile) -> Callable[[], None]:
    """Envelopes of honest robots, again, to their receivers and to others."""

    def shoot() -> None:
        receiver, envelope, _ = peer.envelope()
        peer.post(envelope, receiver)
        peer.post(envelope)

    return shoot


def stale(peer: Hostile) -> Callable[[], None]:
    """Old proposals with nonces of past contacts, and new ones with nonces of contacts between others."""

    def shoot() -> None:
        proposals = [entry for entry in tuple(peer.recorded) if isinstance(entry[2], Propose)]
        receiver, envelope, _ = peer.chance.choice(proposals)
        peer.post(envelope, receiver)
        robot = peer.victim()
        genes = peer.genes().tobytes()
        peer.post(sign_message(peer.proposal(peer.me.id, robot, genes), COLONY, peer.me), robot)

    return shoot


def flood(peer: Hostile) -> Callable[[], None]:
    """Proposals of thousands of made-up robots, validly signed, among replays."""
    identities = [Identity(peer.chance.randbytes(32)) for _ in range(MADE_UP)]
    envelopes = []
    for identity in identities:
        robot = peer.victim()
        proposal = peer.proposal(identity.id, robot, peer.genes().tobytes())
        envelopes.append((robot, sign_message(proposal, COLONY, identity)))
    around = itertools.cycle(envelopes)

    def shoot() -> None:
        receiver, envelope = next(around) if peer.chance.random() < 0.7 else peer.envelope()[:2]
        peer.post(envelope, receiver)

    return shoot


def joins(peer: Hostile) -> Callable[[], None]:
    """Requests of made-up robots for bodies, and noise."""

    def shoot() -> None:
        robot = peer.chance.randbytes(16)
        peer.query(
            peer.arena.join(robot), forged_join(robot, COLONY, peer.chance.randrange(-1, 5), 0)
        )
        peer.query(peer.arena.join(robot), peer.chance.randbytes(40))

    return shoot


def queries(peer: Hostile) -> Callable[[], None]:
    """History queries of observers, without end."""
    incarnations: dict[bytes, int] = {}

    def shoot() -> None:
        robot = peer.victim()
        _, _, message = peer.envelope()
        incarnations[message.encounter.initiator] = message.encounter.incarnation
        peer.query(
            peer.colony.history(robot), encode(HistoryRequest(incarnations.get(robot, 0), 1))
        )
        peer.query(peer.colony.history(robot), peer.chance.randbytes(20))

    return shoot


def observations(peer: Hostile) -> Callable[[], None]:
    """Forged observations: of another arena run, of an earlier tick, with NaN, or noise."""

    def shoot() -> None:
        robot = peer.victim()
        seen = peer.observations[robot]
        row = np.array([peer.chance.uniform(-1e9, 1e9) for _ in range(OBSERVATION_WIDTH)])
        other = peer.chance.randrange(2**62)
        code = peer.chance.randbytes(CODE_BYTES)
        nothing = pack_row(np.full(OBSERVATION_WIDTH, np.nan))
        forged = (
            encode(Observation(other, seen.tick + 5, pack_row(row), None)) + code,
            encode(Observation(seen.arena_run, max(0, seen.tick - 10), pack_row(row), None)) + code,
            encode(Observation(seen.arena_run, seen.tick + 5, nothing, None)) + code,
            encode(Observation(seen.arena_run, seen.tick + 1, pack_row(row), None)) + code,
            peer.chance.randbytes(200),
        )
        peer.put(peer.arena.observation(robot), peer.chance.choice(forged))

    return shoot


def future(peer: Hostile) -> Callable[[], None]:
    """One observation of the right arena run, but of a tick in the far future."""
    robot = peer.robots[0]
    seen = peer.observations[robot]
    peer.put(
        peer.arena.observation(robot),
        encode(Observation(seen.arena_run, 2**52, seen.row, None))
        + peer.chance.randbytes(CODE_BYTES),
    )
    return lambda: None


def telemetry(peer: Hostile) -> Callable[[], None]:
    """Forged states, of robots that do not exist and of those that do, and noise, for observers."""

    def shoot() -> None:
        robot = peer.chance.choice((peer.victim(), peer.chance.randbytes(16)))
        forged = RobotState(
            robot, 0, ARENA, 2**32 - 1, 2**50, 0, 1, 2**50, "x", 0.5, 0, 2**50, 2**50, 0, 0, 0, 0,
            0, 0, 0, 0, 0, 0.0,
        )  # fmt: skip
        peer.put(peer.colony.state(robot), encode(forged))
        peer.put(peer.colony.state(peer.victim()), peer.chance.randbytes(100))

    return shoot


def tokens(peer: Hostile) -> Callable[[], None]:
    """Liveliness tokens in the name of each robot, of an older incarnation, of the last one, and of invalid ones."""
    live = peer.session.liveliness()
    incarnations = ("1", str(2**32 - 1), "²", "9" * 5000)
    declared = [
        live.declare_token(
            peer.colony.alive(robot, 0, "hostile").replace("/0/", f"/{incarnation}/")
        )
        for robot in peer.robots
        for incarnation in incarnations
    ]

    def shoot() -> None:
        assert declared

    return shoot


ATTACKS: Attacks = {
    "oversized": (oversized, 20.0),
    "malformed": (malformed, 500.0),
    "unfit": (unfit, 300.0),
    "impostor": (impostor, 100.0),
    "replay": (replay, 300.0),
    "stale": (stale, 300.0),
    "flood": (flood, 10_000.0),
    "joins": (joins, 1_000.0),
    "queries": (queries, 500.0),
    "observations": (observations, 500.0),
    "future": (future, 1.0),
    "telemetry": (telemetry, 500.0),
    "tokens": (tokens, 1.0),
    **BODY_ATTACKS,
}
"""Every attack"""


def main() -> None:
    """Attack until killed."""
    parser = argparse.ArgumentParser()
    parser.add_argument("attacks", help="of ATTACKS, with commas between them")
    parser.add_argument("--connect", required=True)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--insider", type=Path, nargs=3, metavar=("KEY", "CREDENTIALS", "SPYING"), default=()
    )
    parser.add_argument("robots", nargs="+", type=bytes.fromhex)
    options = parser.parse_args()
    peer = Hostile(options.connect, options.robots, options.seed, insider_of(options.insider))
    while not peer.is_ready:
        time.sleep(0.05)
    attacks = [ATTACKS[name] for name in options.attacks.split(",")]
    shooting = [(attack(peer), per_s) for attack, per_s in attacks]
    print("attacking", flush=True)
    started_s, shots = time.monotonic(), [0] * len(shooting)
    while True:
        for number, (shoot, per_s) in enumerate(shooting):
            due = int((time.monotonic() - started_s) * per_s)
            while shots[number] < due:
                shoot()
                shots[number] += 1
        print(f"{sum(shots)} shots", flush=True)
        time.sleep(1.0 / BURSTS_PER_S)


def insider_of(paths: Sequence[Path]) -> Insider | None:
    """Return the robot that attacks, None for somebody outside."""
    if not paths:
        return None
    key, credentials, spying = paths
    return Insider(load_key(key), credentials, spying)


if __name__ == "__main__":
    main()
