"""Requests to a robot with the reference firmware, their replies, and all else that it sends."""

import itertools
import threading
import time
from collections.abc import Callable
from typing import NoReturn, TypeVar

from crcolony_bridge.errors import DeviceError, DeviceLostError
from crcolony_bridge.link import Link
from crcolony_bridge.reference_firmware import messages
from crcolony_bridge.reference_firmware.frames import Frame, FrameError, FrameReader, encode_frame
from crcolony_bridge.reference_firmware.messages import Info, MessageType, NakReason

_T = TypeVar("_T")
_TRIES, _REPLY_TIMEOUT_S = 5, 0.1
_LEASE_S = 1.2
"""A little longer than the firmware keeps a robot for a controller that is silent."""


class FirmwareSession:
    """A link to one robot. Methods raise DeviceLostError when it is gone.

    `address` is what a person calls it. One thread makes requests and receives, while others may send.
    """

    def __init__(self, link: Link, address: str) -> None:
        self._link, self._address = link, address
        self._frames = FrameReader()
        self._seq = itertools.count(1)
        self._writing = threading.Lock()
        self._pending: list[Frame] = []
        """Frames that arrived while a reply was awaited"""

    def greet(self, session: int, period_ms: int) -> Info:
        """Take the robot, and return what it is; raises DeviceError where a person has to do something.

        The controller before us may have been killed just now: it has the robot for as long as its lease.
        """
        until_s = time.monotonic() + _LEASE_S
        while True:
            refusals: list[int] = []
            reply = self.request(
                lambda seq: messages.hello(session, period_ms, seq), MessageType.INFO, refusals
            )
            if reply is not None or not refusals:
                break
            if refusals[0] != NakReason.SESSION or time.monotonic() > until_s:
                self._explain(refusals[0])
            time.sleep(_REPLY_TIMEOUT_S)
        if reply is None:
            raise DeviceError(
                f"{self._address}: no robot with the reference firmware answers;"
                " check the baud rate, and which firmware is on it"
            )
        self._pending.clear()  # what it sent before it was ours, as that it was switched on
        return self._parsed(lambda: Info.parse(reply))

    def fetch_description(self, size: int) -> bytes:
        """Return the description of the robot, which is so long."""
        text = b""
        while len(text) < size:
            part = self._describe(len(text))
            if not part:
                raise DeviceLostError(f"{self._address}: the robot does not say what it is")
            text += part
        return text[:size]

    def request(
        self,
        make: Callable[[int], Frame],
        expected: MessageType,
        refusals: list[int] | None = None,
    ) -> Frame | None:
        """Send a request until it is answered; return the reply, None for a refusal or none at all.

        The reason of a refusal is appended to `refusals`.
        """
        for _ in range(_TRIES):
            seq = self.send(make)
            end_s = time.monotonic() + _REPLY_TIMEOUT_S
            while (left_s := end_s - time.monotonic()) > 0.0:
                arrived = self._read_link(left_s)
                for k, frame in enumerate(arrived):
                    if frame.seq == seq and frame.type in (expected, MessageType.NAK):
                        self._pending += arrived[k + 1 :]
                        if frame.type == expected:
                            return frame
                        if refusals is not None:
                            refusals.append(frame.payload[1] if len(frame.payload) > 1 else 0)
                        return None
                    self._pending.append(frame)
        return None

    def send(self, make: Callable[[int], Frame]) -> int:
        """Send a frame that is made with a new sequence number; return that."""
        with self._writing:
            seq = next(self._seq) & 0xFFFF
            self._link.write(encode_frame(make(seq)))
        return seq

    def receive(self, timeout_s: float) -> list[Frame]:
        """Return the frames that arrived during a request, or else those that arrive within the time."""
        pending, self._pending = self._pending, []
        return pending or self._read_link(timeout_s)

    def close(self) -> None:
        """Close the link."""
        self._link.close()

    def count_bad_frame(self) -> None:
        """Count a frame whose payload is malformed."""
        self._frames.bad_frames += 1

    @property
    def bad_frames(self) -> int:
        """Frames so far that were damaged or malformed."""
        return self._frames.bad_frames

    def _read_link(self, timeout_s: float) -> list[Frame]:
        return list(self._frames.feed(self._link.read(timeout_s)))

    def _describe(self, offset: int) -> bytes:
        reply = self.request(lambda seq: messages.describe(offset, seq), MessageType.DESCRIPTION)
        if reply is None:
            return b""
        return self._parsed(lambda: messages.parse_description(reply)[2])

    def _explain(self, reason: int) -> NoReturn:
        """Raise DeviceError for a refusal of our greeting."""
        if reason == NakReason.SESSION:
            raise DeviceError(f"{self._address}: another controller drives this robot")
        raise DeviceError(f"{self._address}: its firmware is of another version of the protocol")

    def _parsed(self, parse: Callable[[], _T]) -> _T:
        try:
            return parse()
        except FrameError as error:
            raise DeviceLostError(f"{self._address}: {error}") from None
