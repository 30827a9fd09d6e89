"""Asks once which liveliness tokens there are."""

import zenoh

from crcolony.transport.zenoh_session import Session

_TIMEOUT_S = 2.0


def tokens_online(session: Session, keys: str) -> list[str]:
    """Return the keys of all tokens that match a key expression, as far as they are known within two seconds."""
    replies = session.liveliness().get(keys, timeout=_TIMEOUT_S)
    found = []
    for reply in replies:
        sample = reply.ok
        if isinstance(sample, zenoh.Sample):
            found.append(str(sample.key_expr))
    return sorted(found)
