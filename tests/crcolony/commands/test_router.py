"""`crcolony router`: run a Zenoh router."""

import socket

import pytest
import zenoh

from crcolony.cli import main
from tests.support.command_line import Refused, refusal, start_command, wait_for_line


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("router --client", "--client cannot be used with a router"),
    ],
)
def test_wrong_options_are_refused_in_one_line(words: str, line: str, refused: Refused) -> None:
    """The line names the option or file, and the reason."""
    assert line in refused(words)


def test_a_port_that_is_in_use_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    """The line says what to do."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        endpoint = f"tcp/127.0.0.1:{taken.getsockname()[1]}"
        line = refusal(capsys, "router", "--listen", endpoint)
    assert f"{endpoint}: the port is taken; choose another with --listen" in line


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("--listen tcp/192.0.2.1:7447", "tcp/192.0.2.1:7447: this machine has no such address"),
        ("--interface nosuch0", "interface nosuch0: No such device; it needs an IPv4 address"),
    ],
)
def test_an_address_that_may_come_later_is_waited_for(words: str, line: str) -> None:
    """It is named, not reported as in use; a signal ends the wait, and that is no error."""
    with start_command("router", "--open-network", *words.split()) as process:
        wait_for_line(process, f"waiting for the network: {line}")
        process.terminate()
        assert process.wait(60.0) == 0


def test_its_configuration_is_printed_for_a_router_of_another_make(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Zenoh reads it as it is."""
    assert main(["router", "--listen", "tcp/127.0.0.1:7447", "--print-config"]) == 0
    config = zenoh.Config.from_json5(capsys.readouterr().out)
    assert config.get_json("mode") == '"router"'
