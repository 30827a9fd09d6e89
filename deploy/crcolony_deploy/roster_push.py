"""Publishes a roster to a running colony, and counts who has it."""

import contextlib
import time
from typing import NamedTuple

import zenoh

from crcolony.protocol.codec import WireError, encode
from crcolony.protocol.key_expressions import ROOT, roster_key
from crcolony.protocol.roster import open_roster
from crcolony.protocol.roster_gossip import RosterSerial
from crcolony.transport.close_session import closing
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import open_session
from crcolony_deploy.authority import Authority

_ROUND_S = 0.5
_ROUNDS = 10


class Distribution(NamedTuple):
    """How far a roster has come."""

    have_it: int
    """Processes that have this roster"""
    online: int
    """Processes of the deployment that are online"""
    newer: bytes | None
    """A roster that is newer than the published one, which a process has: the authority's folder is an old copy"""

    @property
    def is_complete(self) -> bool:
        """Whether everybody who is online has it."""
        return self.have_it >= self.online > 0


def push_roster(authority: Authority, network: NetworkSettings) -> Distribution:
    """Publish the roster until all processes that are online have it, for some seconds; raises NetworkError."""
    colony, signed = authority.roster.colony, authority.signed_roster
    key = roster_key(colony)
    with closing(open_session(network)) as session:
        distribution = Distribution(0, 0, None)
        for _ in range(_ROUNDS):
            started_s = time.monotonic()
            session.put(key, signed, express=True)
            time.sleep(_ROUND_S / 2.0)
            distribution = _survey(session, key, authority)
            if distribution.is_complete or distribution.newer:
                return distribution
            time.sleep(max(0.0, started_s + _ROUND_S - time.monotonic()))
        return distribution


def _survey(session: zenoh.Session, key: str, authority: Authority) -> Distribution:
    """Ask everybody for rosters that are newer than the one before this."""
    serial, signed = authority.roster.serial, authority.signed_roster
    request = encode(RosterSerial(max(serial - 1, 1)))
    rosters = [
        reply.ok.payload.to_bytes()
        for reply in session.get(
            key,
            payload=request,
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=_ROUND_S,
        )
        if reply.ok is not None
    ]
    newer = next((one for one in rosters if one != signed and _is_newer(one, authority)), None)
    tokens = session.liveliness().get(f"{ROOT}/**", timeout=_ROUND_S)
    sessions = {
        str(token.ok.key_expr).rpartition("/")[2] for token in tokens if token.ok is not None
    }
    return Distribution(sum(one == signed for one in rosters), len(sessions), newer)


def _is_newer(roster: bytes, authority: Authority) -> bool:
    with contextlib.suppress(WireError):
        opened = open_roster(roster, authority.identity.public_key)
        return opened.serial > authority.roster.serial
    return False
