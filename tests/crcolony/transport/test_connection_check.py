"""An endpoint at which nobody answers is named with the reason, once, and again when somebody answers."""

import contextlib
import socket
from collections.abc import Callable

from crcolony.transport.connection_check import ConnectionCheck
from crcolony.transport.zenoh_session import free_port
from tests.support.process import wait_until


def check(
    *endpoints: str,
    lines: list[str],
    has_links: Callable[[], bool] = lambda: False,
    late_s: float = 60.0,
) -> ConnectionCheck:
    """Return a check that tries often."""
    return ConnectionCheck(endpoints, has_links, lines.append, period_s=0.02, link_timeout_s=late_s)


def test_a_change_is_printed_once() -> None:
    """First that the connection is refused, and then that somebody answers; a wrong name stays one line."""
    port, lines = free_port(), list[str]()
    endpoint, wrong = f"tcp/127.0.0.1:{port}", "tcp/nobody.invalid:7447"
    with check(endpoint, wrong, lines=lines) as running:
        wait_until(lambda: len(lines) == 2, "both are named")
        assert f"no robot, arena or router answers at {endpoint} (connection refused)" in lines[0]
        assert f"answers at {wrong} (its name " in lines[1]
        assert len(running.problems) == 2
        with socket.create_server(("127.0.0.1", port)):
            wait_until(lambda: len(lines) == 3, "somebody answers")
            assert lines[2] == f"{endpoint} answers"
            assert len(running.problems) == 1


def test_a_program_that_is_no_zenoh_is_named_when_no_link_follows() -> None:
    """It accepts connections, and says nothing."""
    lines = list[str]()
    with socket.create_server(("127.0.0.1", 0)) as server:
        endpoint = f"tcp/127.0.0.1:{server.getsockname()[1]}"
        with check(endpoint, lines=lines, late_s=0.05):
            wait_until(lambda: lines, "the endpoint is named")
    assert f"{endpoint} (another program is there)" in lines[0]


def test_an_endpoint_that_has_answered_is_left_alone_while_there_are_links() -> None:
    """It is tried again when the last link is lost."""
    is_linked, lines, connections = [False], list[str](), 0
    with socket.create_server(("127.0.0.1", 0)) as server:
        endpoint = f"tcp/127.0.0.1:{server.getsockname()[1]}"
        with check(endpoint, lines=lines, has_links=lambda: is_linked[0]):
            server.settimeout(5.0)
            server.accept()[0].close()
            is_linked[0] = True
            server.settimeout(0.2)
            with contextlib.suppress(TimeoutError):
                while connections < 100:
                    server.accept()[0].close()
                    connections += 1
            assert connections < 5
            is_linked[0] = False
            server.settimeout(5.0)
            server.accept()[0].close()
    assert not lines
