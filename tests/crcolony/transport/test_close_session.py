"""A session that cannot be closed delays the end of its process for a while, and is one line."""

import threading
from typing import Any

import pytest
import zenoh

from crcolony.transport import close_session as module
from crcolony.transport.close_session import close_session, closing
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import free_port, open_session


class StarvedSession:
    """A session that does not close: it fails, as Zenoh's after 10 s, or waits for ever."""

    def __init__(self, error: Exception | None) -> None:
        self._error = error

    def close(self) -> None:
        if self._error is not None:
            raise self._error
        threading.Event().wait()


@pytest.mark.parametrize("error", [zenoh.ZError("Timeout at /src/close.rs:1"), None])
def test_a_session_that_cannot_be_closed_is_one_line(
    error: Exception | None, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whether Zenoh gives up or hangs."""
    monkeypatch.setattr(module, "_TIMEOUT_S", 0.1)
    session: Any = StarvedSession(error)
    with closing(session):
        pass
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.startswith("the network was not left in time")
    assert printed.err.count("\n") == 1


def test_a_session_is_closed_without_a_word(capsys: pytest.CaptureFixture[str]) -> None:
    """Closing it once more does no harm."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with closing(open_session(NetworkSettings(listen=(endpoint,)))) as session:
        pass
    assert session.is_closed()
    close_session(session)
    assert capsys.readouterr().err == ""
