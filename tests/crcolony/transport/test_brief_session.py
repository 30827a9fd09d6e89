"""A command that ends soon hears also those who were admitted since its credentials were written."""

import threading
import time
from pathlib import Path

import zenoh

from crcolony.protocol.identity import Identity
from crcolony.protocol.key_expressions import ColonyKeys
from crcolony.transport.brief_session import brief_session
from crcolony.transport.connection import Connection
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import free_port, open_session
from tests.support.deployment import Deployment
from tests.support.process import wait_until

ROBOT = Identity(bytes(32))


def test_a_member_that_was_admitted_later_is_heard(tmp_path: Path) -> None:
    """Its own connection brings the newer roster, with which the session is opened again."""
    deployment = Deployment(tmp_path)
    watching = deployment.member("observer", "wall")
    old = (watching / "roster").read_bytes()
    robot = deployment.member("robot", "kitchen", ROBOT)
    endpoint = f"tls/127.0.0.1:{free_port()}"
    speaking = NetworkSettings(listen=(endpoint,), credentials=robot)
    key = ColonyKeys("colony").state(ROBOT.id)
    heard: list[zenoh.Sample] = []
    assert (watching / "roster").read_bytes() == old
    with Connection(speaking, open_session(speaking), lambda line: None) as connection:
        is_over = threading.Event()

        def keep_up() -> None:
            while not is_over.wait(0.02):
                connection.handle_timers(time.monotonic())
                connection.session.put(key, b"here")

        thread = threading.Thread(target=keep_up)
        thread.start()
        try:
            network = NetworkSettings(connect=(endpoint,), credentials=watching)
            with brief_session(network) as session:
                declared = session.declare_subscriber(key, heard.append)
                wait_until(lambda: heard, "the robot is heard", 5.0)
                assert declared
        finally:
            is_over.set()
            thread.join()
    assert (watching / "roster").read_bytes() != old


def test_without_credentials_it_is_a_session_like_any_other() -> None:
    """Open inside the context alone."""
    network = NetworkSettings(listen=(f"tcp/127.0.0.1:{free_port()}",))
    with brief_session(network) as session:
        assert not session.is_closed()
    assert session.is_closed()
