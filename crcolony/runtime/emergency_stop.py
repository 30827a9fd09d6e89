"""Asks all arenas and bridges of a network to stop their bodies, or to release them."""

import secrets
import time
from dataclasses import dataclass

from crcolony.protocol.codec import WireError, encode
from crcolony.protocol.stop_messages import Clear, Stop, StopReply, decode_stop_reply
from crcolony.transport.close_session import closing
from crcolony.transport.zenoh_session import NetworkSettings, has_links, open_session
from crcolony.transport.zenoh_stop import ask_to_stop

_DISCOVERY_S = 1.0
"""So long we look for further bridges: a stop goes out at once, and again to those that are found later."""
_ROUND_S = 0.3
_POLL_S = 0.02


@dataclass(frozen=True)
class StopResult:
    """What was answered: a reply of every bridge, and the names of those that are there and did not answer."""

    replies: tuple[StopReply, ...]
    silent: frozenset[str]
    took_s: float
    """From the first message to the last new reply"""


def stop_robots(network: NetworkSettings, arena: str, latch: int | None) -> StopResult:
    """Stop all robots of the bridges of this name, "*" for all; with a latch, release those of that stop.

    Raises NetworkError where nobody can be reached.
    """
    message = encode(Stop(secrets.token_bytes(16)) if latch is None else Clear(latch))
    replies: dict[str, StopReply] = {}
    silent: set[str] = set()
    with closing(open_session(network)) as session:
        end_s = time.monotonic() + _DISCOVERY_S
        while not has_links(session) and time.monotonic() < end_s:
            time.sleep(_POLL_S)
        began_s = last_s = time.monotonic()
        while True:
            answers, silent = ask_to_stop(session, arena, message, _ROUND_S)
            for bridge, data in answers.items():
                reply = _decoded(data)
                if reply is None:
                    silent.add(bridge)
                elif bridge not in replies or _is_better(reply, replies[bridge]):
                    replies[bridge] = reply
                    last_s = time.monotonic()
            if time.monotonic() > end_s or (replies and not silent and latch is not None):
                break
    return StopResult(tuple(replies.values()), frozenset(silent), last_s - began_s)


def _decoded(data: bytes) -> StopReply | None:
    try:
        return decode_stop_reply(data)
    except WireError:
        return None


def _is_better(reply: StopReply, earlier: StopReply) -> bool:
    """Return whether more robots have confirmed than before."""
    confirmed, before = (sum(robot.confirmed for robot in r.robots) for r in (reply, earlier))
    return confirmed > before
