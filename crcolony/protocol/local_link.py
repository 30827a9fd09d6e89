"""How a robot and its body prove to each other that they have the keys of a link, before they share memory.

They do it on one machine, over a socket (PROTOCOL.md, "Between a robot and its body"): whoever has the memory needs no
codes.
"""

from crcolony.protocol.body_messages import LocalLink, decode_local_link
from crcolony.protocol.codec import WireError, encode
from crcolony.protocol.link_keys import CODE_BYTES, LinkKeys, open_sealed, seal

CHALLENGE_BYTES = 16
"""Random bytes, so that no proof can be used again"""


def prove_robot(link: LocalLink, keys: LinkKeys) -> bytes:
    """Return what a robot sends: that it has the keys of its link."""
    return seal(keys.actions, encode(link))


def prove_body(link: LocalLink, keys: LinkKeys) -> bytes:
    """Return what the body's process replies: that it has them, too."""
    return seal(keys.observations, encode(link))


def read_claim(data: bytes) -> LocalLink:
    """Return what a robot claims to have proved; raises WireError if it is malformed."""
    return decode_local_link(data[:-CODE_BYTES])


def check_robot(data: bytes, link: LocalLink, keys: LinkKeys) -> None:
    """Raise WireError unless a robot has proved this."""
    _check(open_sealed(keys.actions, data), link)


def check_body(data: bytes, link: LocalLink, keys: LinkKeys) -> None:
    """Raise WireError unless the body's process has proved this."""
    _check(open_sealed(keys.observations, data), link)


def _check(content: bytes, link: LocalLink) -> None:
    if decode_local_link(content) != link:
        raise WireError("the proof of another link")
