"""Members that are connected have the newest roster, on the disk too, whichever of them had it."""

import contextlib
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from crcolony.transport.credentials import load_credentials
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.roster_exchange import RosterExchange
from crcolony.transport.zenoh_session import Session, free_port, open_session
from tests.support.deployment import Deployment
from tests.support.process import wait_until


class Members:
    """Sessions of members over mutual TLS, each with its exchange; the first is their seed."""

    def __init__(self, folder: Path, opened: contextlib.ExitStack) -> None:
        self.deployment = Deployment(folder)
        self._opened = opened
        self._endpoint = f"tls/127.0.0.1:{free_port()}"
        self.folders = [self.deployment.member("observer", name) for name in ("a", "b", "c")]
        self.deployment.distribute_roster()
        self.exchanges: list[RosterExchange] = []

    def connect(self, number: int) -> RosterExchange:
        is_seed, folder = number == 0, self.folders[number]
        network = NetworkSettings(
            listen=(self._endpoint,) if is_seed else (),
            connect=() if is_seed else (self._endpoint,),
            credentials=folder,
        )
        session: Session = self._opened.enter_context(open_session(network))
        exchange = RosterExchange(session, load_credentials(folder))
        self.exchanges.append(exchange)
        return exchange

    def wait_for_serial(self, serial: int) -> float:
        def all_have_it() -> bool:
            for exchange in self.exchanges:
                exchange.handle_timers(time.monotonic())
            return {exchange.roster.serial for exchange in self.exchanges} == {serial}

        return wait_until(all_have_it, f"all have roster {serial}", 5.0)


@pytest.fixture
def members(tmp_path: Path) -> Iterator[Members]:
    with contextlib.ExitStack() as opened:
        yield Members(tmp_path, opened)


@pytest.mark.parametrize("who", [0, 2], ids=["the one that was there", "the one that comes"])
def test_a_connection_brings_the_newest_roster(members: Members, who: int) -> None:
    """In either direction, and into the folders of all, for their next start."""
    before = members.deployment.authority.roster.serial
    for number in (0, 1):
        members.connect(number)
    members.wait_for_serial(before)
    members.deployment.authority.revoke("observer.b")
    newest = members.deployment.authority.signed_roster
    if who == 2:
        (members.folders[2] / "roster").write_bytes(newest)
    else:
        assert members.exchanges[0]._gossip.handle_roster(time.monotonic(), newest)
    members.connect(2)
    assert members.wait_for_serial(before + 1) < 2.0
    stored = [(folder / "roster").read_bytes() for folder in members.folders[1:]]
    assert newest in stored


def test_a_roster_of_nobody_changes_nothing(members: Members, tmp_path: Path) -> None:
    """Forged, or noise: a member with a certificate may publish it."""
    serial = members.deployment.authority.roster.serial
    for number in (0, 1):
        members.connect(number)
    members.wait_for_serial(serial)
    forged = Deployment(tmp_path / "other").authority.signed_roster
    first = members.exchanges[0]
    for data in (forged, b"noise", b"x" * 600_000):
        first._put("crcolony/1/roster/colony", data)
    members.deployment.authority.revoke("observer.c")
    first._put("crcolony/1/roster/colony", members.deployment.authority.signed_roster)
    wait_until(
        lambda: members.exchanges[1].handle_timers(time.monotonic()), "it has the genuine one", 5.0
    )
    assert members.exchanges[1].roster.serial == serial + 1
