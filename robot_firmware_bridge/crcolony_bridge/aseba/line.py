"""A line to Aseba nodes: whole messages go out and come in, until the line is gone (DeviceLostError)."""

import threading
import time
from collections.abc import Callable, Sequence

from crcolony_bridge.aseba.protocol import AsebaError, AsebaMessage, AsebaReader, encode_message
from crcolony_bridge.errors import DeviceLostError
from crcolony_bridge.link import Link

_QUIET_S, _MAX_DISCARD_S = 0.015, 0.3
"""A line that is quiet for so long is between two messages."""
_SHORTEST_WAIT_S = 1e-3


class AsebaLine:
    """One thread receives, any may send. `address` is what a person calls the line."""

    def __init__(self, link: Link, address: str) -> None:
        self._link, self._address = link, address
        self._reader = AsebaReader()
        self._writing = threading.Lock()

    def discard_half_messages(self) -> None:
        """Leave out what was on its way before we were there: a line may be opened in the middle of a message."""
        end_s = time.monotonic() + _MAX_DISCARD_S
        while self._link.read(_QUIET_S) and time.monotonic() < end_s:
            pass

    def send(self, message: AsebaMessage) -> None:
        """Send a message."""
        with self._writing:
            self._link.write(encode_message(message))

    def receive(self, timeout_s: float) -> Sequence[AsebaMessage]:
        """Return the messages that arrive within the time."""
        try:
            return self._reader.feed(self._link.read(max(timeout_s, _SHORTEST_WAIT_S)))
        except DeviceLostError as error:
            # Over TCP the last client wins: a robot that is taken looks like one that is switched off.
            hint = ": off, or taken by another controller" if self._address[:4] == "tcp:" else ""
            raise DeviceLostError(f"{error}{hint}") from None
        except AsebaError as error:
            raise DeviceLostError(
                f"{self._address}: this is no stream of Aseba's: {error}"
            ) from None

    def wait(self, is_met: Callable[[AsebaMessage], bool], timeout_s: float) -> bool:
        """Receive until a message meets a condition; return False after the time."""
        end_s = time.monotonic() + timeout_s
        while (left_s := end_s - time.monotonic()) > 0.0:
            met = [
                is_met(message) for message in self.receive(left_s)
            ]  # all: the rest would be lost
            if any(met):
                return True
        return False

    def close(self) -> None:
        """Close the line."""
        self._link.close()
