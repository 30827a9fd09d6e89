"""A connection replaces its session when the certificate or the roster changes, and tells who has to know."""

import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from crcolony.protocol.roster import Roster
from crcolony.transport.connection import Connection
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import Session, free_port, open_session
from tests.support.deployment import Deployment
from tests.support.process import wait_until


class Moved:
    """Notes the sessions to which it is moved."""

    def __init__(self) -> None:
        self.sessions: list[Session] = []

    def move_to(self, session: Session) -> Callable[[], None]:
        self.sessions.append(session)
        return lambda: None


class Connected:
    """A connection of a member that listens, and what it has said."""

    def __init__(self, folder: Path) -> None:
        self.deployment = Deployment(folder)
        self.credentials = self.deployment.member("observer", "wall")
        endpoint = f"tls/127.0.0.1:{free_port()}"
        network = NetworkSettings(listen=(endpoint,), credentials=self.credentials)
        self.connection = Connection(network, open_session(network), lambda line: None)
        self.rosters: list[Roster] = []
        self.user = Moved()
        self.connection.on_roster(self.rosters.append)
        self.connection.add_user(self.user)

    def moves(self, count: int) -> bool:
        self.connection.handle_timers(time.monotonic())
        return len(self.user.sessions) >= count


@pytest.fixture
def connected(tmp_path: Path) -> Iterator[Connected]:
    made = Connected(tmp_path)
    with made.connection:
        yield made


def test_a_renewed_certificate_brings_another_session(connected: Connected) -> None:
    """In two steps, as the process listens on a fixed port; one that is not renewed keeps its session."""
    first = connected.connection.session
    assert not connected.moves(1)
    connected.deployment.renew(connected.credentials)
    wait_until(lambda: connected.moves(2), "it has moved twice")
    assert connected.connection.session is not first
    wait_until(lambda: connected.connection._renewal is None or connected.moves(3), "it is over")
    assert len(connected.user.sessions) == 2


def test_a_newer_roster_is_told_at_once_and_in_force_soon(connected: Connected) -> None:
    """Who has to refuse somebody does so before the access control of the next session does."""
    assert [roster.serial for roster in connected.rosters] == [2]
    connected.deployment.authority.revoke("wall")
    exchange = connected.connection._exchange
    assert exchange is not None
    exchange._rosters.put(connected.deployment.authority.signed_roster)
    connected.connection.handle_timers(time.monotonic())
    assert [roster.serial for roster in connected.rosters] == [2, 3]
    assert connected.user.sessions == []
    wait_until(lambda: connected.moves(1), "it has moved")


def test_a_certificate_that_is_away_for_a_moment_ends_nothing(connected: Connected) -> None:
    """A disk may be; the session is kept until there is another certificate."""
    path = connected.credentials / "identity.pem"
    os.rename(path, hidden := path.with_name("hidden"))
    deadline_s = time.monotonic() + 1.5
    while time.monotonic() < deadline_s:
        assert not connected.moves(1)
        time.sleep(0.1)
    os.rename(hidden, path)


def test_without_credentials_there_is_no_roster(tmp_path: Path) -> None:
    """And nothing is ever due."""
    network = NetworkSettings(listen=(f"tcp/127.0.0.1:{free_port()}",))
    with Connection(network, open_session(network), lambda line: None) as connection:
        told: list[Roster] = []
        connection.on_roster(told.append)
        connection.handle_timers(time.monotonic())
        assert told == []
