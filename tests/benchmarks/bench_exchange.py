"""How many signed genotype exchanges a second two processes make over Zenoh, with nothing written to disk.

Run with `make bench`, or `python -m tests.benchmarks.bench_exchange`. An exchange is a Propose that is signed, sent,
opened, verified and checked, and an Accept that comes back likewise. The baseline is a bare Zenoh round trip of the
same sizes, in turns with them, between the same two processes. Printed, too, is how near to it an exchange could come
if it took no more than the round trip and its two signatures, made and verified.
"""

import statistics
import time
from collections.abc import Callable
from multiprocessing.connection import Connection

from crcolony.config import Config
from crcolony.protocol.codec import WireError
from crcolony.protocol.envelope import has_valid_signature, open_envelope, sign_message
from crcolony.protocol.identity import Identity, is_signed
from crcolony.protocol.mating_messages import (
    Accept,
    Encounter,
    MatingMessage,
    Propose,
    pack_genes,
    unpack_genes,
)
from crcolony.robot.factory import make_robots, own_streams
from crcolony.robot.genes import agent_schema
from crcolony.transport.network_settings import NetworkSettings
from tests.benchmarks.processes import COLONY, Wire, child, here

TURNS, PER_TURN = 10, 500
PIPELINED, WINDOW = 10_000, 64
TARGETS = {"one at a time": 2_000, "pipelined": 4_000}
SCHEMA = agent_schema(Config().learning, Config().heredity)
DIGEST = bytes.fromhex(SCHEMA.digest)
ME, PEER = Identity(bytes(32)), Identity(bytes([1]) * 32)


def own_genes(identity: Identity) -> bytes:
    _, _, (robot,) = make_robots(Config(), [identity.id.hex()], own_streams([identity.id]))
    robot.start()
    return pack_genes(robot.mating_offer().genes)


def read(envelope: bytes) -> MatingMessage:
    """Open an envelope as the robot that waits for it does; raises WireError."""
    sealed, message = open_envelope(envelope)
    if not has_valid_signature(sealed, COLONY):
        raise WireError("forged")
    assert isinstance(message, Propose | Accept)
    unpack_genes(message.genes, SCHEMA)
    return message


def propose(count: int, genes: bytes) -> bytes:
    encounter = Encounter(ME.id, PEER.id, 1, count)
    return sign_message(Propose(encounter, count, DIGEST, "me/1", genes), COLONY, ME)


def respond(connection: Connection, network: NetworkSettings) -> None:
    """Accept every proposal; echo what is bare."""
    genes = own_genes(PEER)
    with Wire(network, "bench/to") as wire:
        wire.wait_for_subscriber("bench/back")
        connection.send("ready")
        while True:
            data = wire.get()
            if not data:
                continue
            if data[:1] == b"\0":
                wire.put("bench/back", data)
                continue
            message = read(data)
            assert isinstance(message, Propose)
            accept = Accept(message.encounter, message.nonce, DIGEST, "peer/1", genes)
            wire.put("bench/back", sign_message(accept, COLONY, PEER))


def rate(times: int, run: Callable[[], None]) -> float:
    """Return how often a second something is done."""
    start = time.perf_counter()
    run()
    return times / (time.perf_counter() - start)


def signatures_s(envelope: bytes) -> float:
    """Return how long a processor needs to sign this message and to verify it, twice, in seconds."""
    sealed, _ = open_envelope(envelope)
    start_s = time.process_time()
    for _ in range(2 * PER_TURN):
        assert is_signed(sealed.content, ME.sign(sealed.content), ME.public_key)
    return (time.process_time() - start_s) / PER_TURN


def main() -> None:
    endpoint, genes = here(), own_genes(ME)
    with (
        Wire(NetworkSettings(listen=(endpoint,)), "bench/back") as wire,
        child(respond, NetworkSettings(connect=(endpoint,))) as ready,
    ):
        assert ready.recv() == "ready"
        wire.wait_for_subscriber("bench/to")
        size = len(propose(1, genes))

        def answer() -> bytes:
            while not (data := wire.get()):
                pass
            return data

        def bare() -> None:
            for _ in range(PER_TURN):
                wire.put("bench/to", bytes(size))
                answer()

        def one_at_a_time() -> None:
            for count in range(PER_TURN):
                wire.put("bench/to", propose(count, genes))
                read(answer())

        def pipelined() -> None:
            for count in range(PIPELINED + WINDOW):
                if count >= WINDOW:
                    read(answer())
                if count < PIPELINED:
                    wire.put("bench/to", propose(count, genes))

        bare()
        turns = [(rate(PER_TURN, bare), rate(PER_TURN, one_at_a_time)) for _ in range(TURNS)]
        trips, single = map(statistics.median, zip(*turns, strict=True))
        many = statistics.median(rate(PIPELINED, pipelined) for _ in range(3))
    print(f"bare Zenoh round trips of {size} bytes, one at a time: {trips:.0f} a second")
    signing_s = signatures_s(propose(1, genes))
    limit = 1.0 / (1.0 + trips * signing_s)
    print(
        f"two signatures, made and verified: {1e6 * signing_s:.0f} us of a processor, caches warm;"
        f" exchanges with nothing else: {limit:.2f} of the bare round trips"
    )
    for name, figure in (("one at a time", single), ("pipelined", many)):
        print(
            f"signed exchanges, {name}: {figure:.0f} a second (target {TARGETS[name]}),"
            f" {figure / trips:.2f} of the bare round trips"
        )


if __name__ == "__main__":
    main()
