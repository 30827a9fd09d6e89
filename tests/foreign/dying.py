"""A robot that dies in the middle of a mating, as by a power cut: `python -m tests.foreign.dying --before commit …`."""

import os
import signal

from tests.foreign.identity import open_envelope
from tests.foreign.messages import ENVELOPE_BYTES, MATING, decode
from tests.foreign.network import Network
from tests.foreign.robot import ForeignRobot, live, parser


class DyingNetwork(Network):
    """It ends the process before it sends the first message of this name: what that depends on is on the disk."""

    before = ""

    def send_envelope(self, to: bytes, envelope: bytes) -> None:
        if decode(open_envelope(envelope).content, ENVELOPE_BYTES, *MATING)[0] == self.before:
            os.kill(os.getpid(), signal.SIGKILL)
        super().send_envelope(to, envelope)


def main() -> None:
    asked = parser(__doc__)
    asked.add_argument("--before", choices=MATING, required=True)
    options = asked.parse_args()
    DyingNetwork.before = options.before
    live(ForeignRobot(options, DyingNetwork))


if __name__ == "__main__":
    main()
