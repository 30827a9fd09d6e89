"""A link that damages bytes in both directions, as an electric motor beside a cable does."""

import random

from crcolony_bridge.link import Link, open_link


class NoisyLink:
    """Flips a random bit in this share of all bytes, while it is noisy."""

    def __init__(self, link: Link, share: float, generator: random.Random) -> None:
        self._link, self._share, self._generator = link, share, generator
        self.is_noisy = True

    def read(self, timeout_s: float) -> bytes:
        """See `Link`."""
        return self._through(self._link.read(timeout_s))

    def write(self, data: bytes) -> None:
        """See `Link`."""
        self._link.write(self._through(data))

    def close(self) -> None:
        """See `Link`."""
        self._link.close()

    def _through(self, data: bytes) -> bytes:
        if not self.is_noisy:
            return data
        return bytes(
            byte ^ 1 << self._generator.randrange(8)
            if self._generator.random() < self._share
            else byte
            for byte in data
        )


class NoisyLinks:
    """Opens links that are all noisy, or all clean."""

    def __init__(self, share: float) -> None:
        self._share, self._generator = share, random.Random(1)
        self._opened: list[NoisyLink] = []
        self._is_noisy = False

    def open(self, address: str, baud: int) -> Link:
        """Open a link."""
        self._opened.append(NoisyLink(open_link(address, baud), self._share, self._generator))
        self._opened[-1].is_noisy = self._is_noisy
        return self._opened[-1]

    def set_noisy(self, is_noisy: bool) -> None:
        """Begin or end the noise."""
        self._is_noisy = is_noisy
        for link in self._opened:
            link.is_noisy = is_noisy
