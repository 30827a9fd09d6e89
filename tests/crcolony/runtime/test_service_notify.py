"""systemd learns when a service is ready, and that its loop turns, on the socket that it names; else nobody is told."""

import contextlib
import os
import signal
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from crcolony.runtime.service_notify import START_EXTENSION_S, ServiceNotifier, service_notifier
from crcolony.transport.zenoh_session import free_port
from tests.support.process import Process, wait_until
from tests.support.process_colony import crcolony


class Listener:
    """systemd's end of the socket."""

    def __init__(self, path: Path) -> None:
        self.address = str(path)
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(self.address)

    def messages(self, within_s: float = 0.0) -> list[str]:
        """Return what has arrived, or arrives first within a time."""
        found = list[str]()
        self._socket.settimeout(within_s)
        with contextlib.suppress(BlockingIOError, TimeoutError):
            while True:
                found.append(self._socket.recv(4096).decode())
                self._socket.setblocking(False)
        return found

    def close(self) -> None:
        """Close it: systemd is gone."""
        self._socket.close()


@pytest.fixture
def systemd(tmp_path: Path) -> Iterator[Listener]:
    """A listener on a socket of its own."""
    listener = Listener(tmp_path / "notify")
    yield listener
    listener.close()


def test_ready_and_stopping_arrive_as_systemd_wants_them(systemd: Listener) -> None:
    """With a status for people."""
    service = service_notifier({"NOTIFY_SOCKET": systemd.address})
    service.say_ready("robot ada")
    service.say_stopping()
    ready, stopping = systemd.messages()
    assert {"READY=1", "STATUS=robot ada"} < set(ready.split("\n"))
    assert stopping == "STOPPING=1"


def test_the_watchdog_is_fed_at_less_than_half_its_time_however_fast_the_loop_turns(
    systemd: Listener,
) -> None:
    """A loop of a thousand turns a second sends no thousand messages."""
    environment = {"NOTIFY_SOCKET": systemd.address, "WATCHDOG_USEC": "20000000"}
    service = service_notifier(environment)
    for millisecond in range(20_000):
        service.feed(100.0 + millisecond / 1000.0)
    assert systemd.messages() == ["WATCHDOG=1"] * 4


def test_a_loop_feeds_the_watchdog_as_it_asks_whether_to_stop(systemd: Listener) -> None:
    """One that no longer turns does not, and one that is stopped says so."""
    environment = {"NOTIFY_SOCKET": systemd.address, "WATCHDOG_USEC": "1"}
    turns = iter([False, False, True])
    is_stopped = service_notifier(environment).watching(lambda: next(turns))
    assert not is_stopped()
    assert systemd.messages() == ["WATCHDOG=1"]
    assert systemd.messages() == []
    while not is_stopped():
        pass
    assert systemd.messages() == ["WATCHDOG=1", "WATCHDOG=1", "STOPPING=1"]


def test_a_start_that_makes_progress_may_take_longer(systemd: Listener) -> None:
    """A loop that waits for the network extends it while it turns, compiling with every line that it prints."""
    service = service_notifier({"NOTIFY_SOCKET": systemd.address})
    extension = f"EXTEND_TIMEOUT_USEC={START_EXTENSION_S * 1e6:.0f}"
    is_stopped = service.starting(lambda: False)
    assert not is_stopped()
    assert not is_stopped()
    assert systemd.messages() == [f"{extension}\nSTATUS=waiting for the network"]
    printed = list[str]()
    print_line = service.reporting(printed.append)
    print_line("compiling, 25 %")
    print_line("compiling, 50 %")
    assert printed == ["compiling, 25 %", "compiling, 50 %"]
    assert [message.split("\n")[0] for message in systemd.messages()] == [extension] * 2


@pytest.mark.parametrize(
    "environment",
    [
        {},
        {"NOTIFY_SOCKET": ""},
        {"NOTIFY_SOCKET": "vsock:2:3", "WATCHDOG_USEC": "1"},
        {"NOTIFY_SOCKET": "/nowhere/at/all", "WATCHDOG_USEC": "1"},
        {"WATCHDOG_USEC": "many"},
    ],
)
def test_without_systemd_nothing_happens(environment: dict[str, str]) -> None:
    """Nothing fails either where its socket is gone, or of a kind that is not known."""
    service = service_notifier(environment)
    service.say_ready("robot")
    assert not service.watching(lambda: False)()
    assert service.starting(lambda: True)()
    service.say_stopping()


def test_a_watchdog_of_another_process_is_not_fed(systemd: Listener) -> None:
    """A process that a service starts inherits its environment."""
    other = str(os.getpid() + 1)
    environment = {"NOTIFY_SOCKET": systemd.address, "WATCHDOG_USEC": "1", "WATCHDOG_PID": other}
    assert not service_notifier(environment).watching(lambda: False)()
    assert systemd.messages() == []


def test_an_abstract_socket_is_reached(tmp_path: Path) -> None:
    """It begins with an @."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listening:
        name = f"crcolony-{os.getpid()}"
        listening.bind(f"\0{name}")
        service_notifier({"NOTIFY_SOCKET": f"@{name}"}).say_stopping()
        assert listening.recv(100) == b"STOPPING=1"


def test_nobody_is_told_of_a_process_that_systemd_has_not_started() -> None:
    """The loop asks its own question then, with no detour."""
    never = lambda: False  # noqa: E731
    assert ServiceNotifier().watching(never) is never
    assert ServiceNotifier().starting(never) is never


def test_a_router_is_ready_when_it_listens_and_feeds_until_its_loop_is_stopped(
    systemd: Listener, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """SIGSTOP is a loop that hangs: no sign comes any more. SIGTERM is said before the end."""
    monkeypatch.setenv("NOTIFY_SOCKET", systemd.address)
    monkeypatch.setenv("WATCHDOG_USEC", "2000000")
    command = crcolony("router", "--listen", f"tcp/127.0.0.1:{free_port()}")
    router = Process(command, tmp_path / "router.log").start()
    try:
        received = list[str]()

        def hears(text: str) -> bool:
            received.extend(systemd.messages())
            return any(text in message for message in received)

        wait_until(lambda: hears("READY=1"), "the router is ready")
        assert "router at" in router.output
        wait_until(lambda: received.count("WATCHDOG=1") >= 2 or hears("-"), "it feeds")
        router.signal(signal.SIGSTOP)
        systemd.messages()
        assert systemd.messages(within_s=2.5) == []
        router.signal(signal.SIGCONT)
        received.clear()
        wait_until(lambda: hears("WATCHDOG=1"), "it feeds again")
        router.stop()
        assert hears("STOPPING=1")
    finally:
        if router.is_running:
            router.kill()
