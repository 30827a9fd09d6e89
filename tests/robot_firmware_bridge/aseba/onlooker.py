"""A second client of a robot: asks for its motors, in the robot's own protocol and without our driver."""

import time

from crcolony_bridge.aseba.protocol import (
    AsebaMessage,
    AsebaReader,
    AsebaType,
    NodeDescription,
    encode_message,
    parse_description,
    request,
)
from crcolony_bridge.link import Link, open_link


class Onlooker:
    """Connects, and by that drops the client before it, which may be frozen or dead."""

    def __init__(self, address: str, node: int = 1) -> None:
        self._link: Link = open_link(address, 0)
        self._reader, self._node = AsebaReader(), node
        self._pending: list[AsebaMessage] = []
        self._description: NodeDescription | None = None
        self._send(request(AsebaType.GET_NODE_DESCRIPTION, node))
        while self._description is None or not self._description.is_complete:
            message = self._next()
            if message.type == AsebaType.DESCRIPTION:
                self._description = parse_description(message)
            elif self._description is not None:
                self._description.add(message)

    def value(self, name: str) -> int:
        """Return a variable's value now."""
        assert self._description is not None
        address = self._description.address(name)
        self._send(request(AsebaType.GET_VARIABLES, self._node, address, 1))
        while True:
            message = self._next()
            if message.type == AsebaType.VARIABLES and message.words[0] == address:
                return message.words[1]

    def set(self, name: str, value: int) -> None:
        """Set a variable."""
        assert self._description is not None
        address = self._description.address(name)
        self._send(request(AsebaType.SET_VARIABLES, self._node, address, value))

    def close(self) -> None:
        """Leave."""
        self._link.close()

    def _send(self, message: AsebaMessage) -> None:
        self._link.write(encode_message(message))

    def _next(self) -> AsebaMessage:
        end_s = time.monotonic() + 5.0
        while not self._pending:
            assert time.monotonic() < end_s, "the robot does not answer"
            self._pending += self._reader.feed(self._link.read(0.5))
        return self._pending.pop(0)
