"""Asks all arenas and bridges of a network to stop their bodies, or to release them."""

import secrets
import time
from dataclasses import dataclass

from crcolony.protocol.codec import WireError, encode
from crcolony.protocol.stop_messages import (
    Clear,
    Stop,
    StopAddress,
    StopReply,
    decode_stop_reply,
)
from crcolony.transport.close_session import closing
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import has_links, open_session
from crcolony.transport.zenoh_stop import ask_to_stop

_DISCOVERY_S = 1.0
"""So long we look for further bridges: a stop goes out at once, and again to those that are found later."""
_ROUND_S = 0.3
_POLL_S = 0.02


@dataclass(frozen=True)
class StopResult:
    """What was answered, and what was not."""

    replies: tuple[StopReply, ...]
    silent: frozenset[StopAddress]
    """Arenas and bridges that are there, as far as we or those who replied see, and have not replied"""
    took_s: float
    """From the first message to the last new reply"""
    is_connected: bool
    """Whether anybody was reached at all"""


def stop_robots(network: NetworkSettings, arena: str, latch: int | None) -> StopResult:
    """Stop all robots of the bridges of this name, "*" for all; with a latch, release those of that stop.

    Raises NetworkError where nobody can be reached.
    """
    message = encode(Stop(secrets.token_bytes(16)) if latch is None else Clear(latch))
    replies: dict[StopAddress, StopReply] = {}
    is_connected = False
    with closing(open_session(network)) as session:
        end_s = time.monotonic() + _DISCOVERY_S
        while not has_links(session) and time.monotonic() < end_s:
            time.sleep(_POLL_S)
        began_s = last_s = time.monotonic()
        while True:
            answers, seen = ask_to_stop(session, arena, message, _ROUND_S)
            is_connected = is_connected or has_links(session)
            for reply in filter(None, map(_decoded, answers)):
                earlier = replies.get(reply.address)
                if earlier is None or _is_better(reply, earlier):
                    replies[reply.address] = reply
                    last_s = time.monotonic()
            silent = _silent(replies, seen, arena)
            if time.monotonic() > end_s or (replies and not silent and latch is not None):
                break
    return StopResult(
        tuple(replies[address] for address in sorted(replies)),
        frozenset(silent),
        last_s - began_s,
        is_connected,
    )


def _silent(
    replies: dict[StopAddress, StopReply], seen: set[StopAddress], arena: str
) -> set[StopAddress]:
    """Return who is there and has not replied."""
    named = {other for reply in replies.values() for other in reply.others}
    there = {address for address in seen | named if arena in ("*", address.arena)}
    return there - replies.keys()


def _decoded(data: bytes) -> StopReply | None:
    try:
        return decode_stop_reply(data)
    except WireError:
        return None


def _is_better(reply: StopReply, earlier: StopReply) -> bool:
    """Return whether more robots have confirmed than before."""
    confirmed, before = (sum(robot.confirmed for robot in r.robots) for r in (reply, earlier))
    return confirmed > before
