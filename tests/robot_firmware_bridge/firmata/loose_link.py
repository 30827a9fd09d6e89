"""A link with a loose contact: a test says what of the bytes to a robot is lost, and what else comes from it."""

from collections.abc import Callable

from crcolony_bridge.link import Link, open_link

Loss = Callable[[bytes], bytes]
"""Returns what is left of what is written at once"""


def nothing_lost(data: bytes) -> bytes:
    """Let everything through."""
    return data


class LooseLink:
    """A `Link` around another one."""

    def __init__(self, link: Link) -> None:
        self._link = link
        self.lose: Loss = nothing_lost
        self.noise = b""
        """Comes before what the robot sends, once"""

    def read(self, timeout_s: float) -> bytes:
        """See `Link`."""
        noise, self.noise = self.noise, b""
        return noise + self._link.read(timeout_s)

    def write(self, data: bytes) -> None:
        """See `Link`."""
        left = self.lose(data)
        if left:
            self._link.write(left)

    def close(self) -> None:
        """See `Link`."""
        self._link.close()


class LooseLinks:
    """Opens links, and has the last one."""

    def __init__(self) -> None:
        self.opened: list[LooseLink] = []

    def open(self, address: str, baud: int) -> Link:
        """Open a link."""
        self.opened.append(LooseLink(open_link(address, baud)))
        return self.opened[-1]

    @property
    def last(self) -> LooseLink:
        """The one that is in use."""
        return self.opened[-1]
