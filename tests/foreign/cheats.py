"""Robots that cheat, to see that they are refused: `python -m tests.foreign.cheats --cheat code …`."""

import argparse
import random
import threading

import zenoh
from nacl.signing import SigningKey

from tests.foreign.body_link import body_request
from tests.foreign.identity import open_envelope, seal
from tests.foreign.messages import ENVELOPE_BYTES, MATING, decode, encode, numbers, packed
from tests.foreign.network import Network
from tests.foreign.robot import ForeignRobot, live, parser

PERIOD_S = 0.5
HUGE = 1e6


class CheatingRobot(ForeignRobot):
    """An honest robot but for its network, and perhaps its genes."""

    def __init__(self, options: argparse.Namespace, network_kind: "type[Cheat]") -> None:
        super().__init__(options, network_kind)
        assert isinstance(self.network, Cheat)
        self.network.key, self.network.options = self.key, options

    def run(self) -> None:
        if isinstance(self.network, HugeGenes):
            bounded = next(k for k, gene in enumerate(self.species.genes) if gene.high < HUGE)
            genes = list(numbers(self.species.drawn(random.Random())))
            genes[bounded] = HUGE
            self.agents.first_genes = packed(tuple(genes))
        super().run()


class Cheat(Network):
    """What it has of the robot that cheats."""

    key: SigningKey
    options: argparse.Namespace


class HugeGenes(Cheat):
    """It offers genes out of their range."""


class WrongSignature(Cheat):
    """It signs nothing that it sends to robots."""

    def send_envelope(self, to: bytes, envelope: bytes) -> None:
        super().send_envelope(to, envelope[:-1] + bytes([envelope[-1] ^ 1]))


class WrongCode(Cheat):
    """It commands its body with a wrong code."""

    def send_action(self, action: bytes) -> None:
        super().send_action(action[:-1] + bytes([action[-1] ^ 1]))


class CommitWithoutAccept(Cheat):
    """It says that it has decided what its partner was never prepared for."""

    def send_envelope(self, to: bytes, envelope: bytes) -> None:
        content = decode(open_envelope(envelope).content, ENVELOPE_BYTES, *MATING)
        if content[0] in ("propose", "accept"):
            initiator, responder, *number = content[1]
            me, other = (
                bytes.fromhex(self.robot),
                responder if initiator.hex() == self.robot else initiator,
            )
            commit = encode(["commit", [me, other, *number]])
            envelope = seal(self.key, f"crcolony mating 1 {self.options.colony}", commit)
        super().send_envelope(to, envelope)


class RepeatedCheat(Cheat):
    """It cheats again and again, beside all else."""

    def declare(self, incarnation: int) -> None:
        super().declare(incarnation)
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._repeat)
        self._thread.start()

    def close(self) -> None:
        self._is_over.set()
        self._thread.join()
        super().close()

    def cheat(self) -> None:
        raise NotImplementedError

    def _repeat(self) -> None:
        while not self._is_over.wait(PERIOD_S):
            self.cheat()


class OtherName(RepeatedCheat):
    """It asks for the bodies of the other robots, under their keys, in their name and in its own."""

    count = 2**52  # above all of theirs

    def cheat(self) -> None:
        run = next((int(key[5]) for key in self._tokens(f"{self.arena}/alive/*/*")), None)
        robots = {key[5] for key in self._tokens(f"{self.colony}/alive/*/*/*")}
        for other in robots - {self.robot} if run is not None else ():
            self.count += 1
            for name in (other, self.robot):
                who = [bytes.fromhex(name), self.options.colony, -1, run, 2**32 - 1, self.count]
                request = body_request(self.key, self.options.arena, ["join", *who]).envelope
                self.session.get(f"{self.arena}/body/{other}/join", print_grant, payload=request)

    def _tokens(self, keys: str) -> list[list[str]]:
        replies = self.session.liveliness().get(keys)
        return [str(reply.ok.key_expr).split("/") for reply in replies if reply.ok is not None]


class ReplayedRequest(RepeatedCheat):
    """It listens to the requests of all robots for bodies, its own too, and repeats them."""

    def declare(self, incarnation: int) -> None:
        self.overheard: dict[bytes, str] = {}
        super().declare(incarnation)
        keys = f"{self.arena}/body/*/join"
        self._declared.insert(0, self.session.declare_queryable(keys, self._overhear))

    def cheat(self) -> None:
        requests = list(self.overheard.items())
        for request, key in requests:
            self.session.get(key, lambda reply: None, payload=request)
        contents = [open_envelope(request).content for request, _ in requests]
        names = [decode(content, ENVELOPE_BYTES, "join", "leave")[0] for content in contents]
        print("repeats", *sorted(names), flush=True)

    def _overhear(self, query: zenoh.Query) -> None:
        if query.payload is not None:
            self.overheard[query.payload.to_bytes()] = str(query.key_expr)
        query.drop()  # type: ignore[no-untyped-call]


def print_grant(reply: zenoh.Reply) -> None:
    """Only an arena that is deceived grants a body here."""
    if reply.ok is not None and b"body_granted" in reply.ok.payload.to_bytes():
        print("deceived the arena", flush=True)


CHEATS: dict[str, type[Cheat]] = {
    "genes": HugeGenes,
    "signature": WrongSignature,
    "code": WrongCode,
    "commit": CommitWithoutAccept,
    "name": OtherName,
    "replay": ReplayedRequest,
}


def main() -> None:
    asked = parser(__doc__)
    asked.add_argument("--cheat", choices=CHEATS, required=True)
    options = asked.parse_args()
    live(CheatingRobot(options, CHEATS[options.cheat]))


if __name__ == "__main__":
    main()
