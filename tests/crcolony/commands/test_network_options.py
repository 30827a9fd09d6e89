"""Options become network settings, a clock, and a config with enough slots."""

import argparse
from pathlib import Path

import pytest

from crcolony.commands.earlier_run import Start, add_from
from crcolony.commands.network_options import (
    add_clock,
    add_names,
    add_network,
    check_names,
    config_for_robots,
    network_of,
    wall_period_s,
)
from crcolony.commands.options import UsageError, add_config
from crcolony.config import Config
from crcolony.transport.interface import NetworkError
from crcolony.transport.network_settings import HERE, HERE_ENCRYPTED

A, B = "tcp/10.0.0.1:7447", "tcp/10.0.0.2:7447"


def parse(*words: str) -> argparse.Namespace:
    """Return the options of a command that has them all."""
    parser = argparse.ArgumentParser()
    add_config(parser)
    add_names(parser)
    add_network(parser)
    add_clock(parser)
    add_from(parser)
    parser.add_argument("-n", type=int)
    parser.add_argument("--robots", type=int)
    parser.add_argument("--minutes", type=float)
    parser.add_argument("--out", type=Path)
    return parser.parse_args(words)


def _config(*words: str) -> Config:
    """Return the config of a host with two spare slots, that starts three robots if no option says so."""
    options = parse(*words)
    return config_for_robots(options, Start(options, "host"), usual=3, spare_slots=2)


@pytest.mark.parametrize(
    ("words", "listens_here", "role", "connect", "listen"),
    [
        ((), True, "peer", (), (HERE,)),
        ((), False, "peer", (HERE,), ()),
        (("--connect", A, "--connect", B), False, "peer", (A, B), ()),
        (("--listen", A), True, "peer", (), (A,)),
        (("--client",), True, "client", (HERE,), ()),
        (("--client", "--connect", A), False, "client", (A,), ()),
        (("--interface", "lo"), True, "peer", (), ()),
    ],
)
def test_options_become_network_settings(
    words: tuple[str, ...],
    listens_here: bool,
    role: str,
    connect: tuple[str, ...],
    listen: tuple[str, ...],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Without any, processes of one machine find each other at its default endpoint."""
    monkeypatch.setenv("CRCOLONY_OPEN_NETWORK", "yes")
    words = (*words, "--open-network")
    network = network_of(parse(*words), listens_here)
    assert (network.role, network.connect, network.listen) == (role, connect, listen)


@pytest.mark.parametrize("words", [("--connect", A), ("--listen", A), ("--interface", "eth0")])
def test_an_open_network_beyond_this_machine_needs_two_switches(
    words: tuple[str, ...], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """One of them could be there by accident; with both it is said loudly."""
    monkeypatch.delenv("CRCOLONY_OPEN_NETWORK", raising=False)
    with pytest.raises(UsageError, match="of which --open-network is missing"):
        network_of(parse(*words))
    with pytest.raises(UsageError, match="of which CRCOLONY_OPEN_NETWORK=yes is missing"):
        network_of(parse(*words, "--open-network"))
    monkeypatch.setenv("CRCOLONY_OPEN_NETWORK", "yes")
    with pytest.raises(UsageError, match="of which --open-network is missing"):
        network_of(parse(*words))
    assert capsys.readouterr().err == ""
    network_of(parse(*words, "--open-network"))
    assert capsys.readouterr().err.startswith("OPEN NETWORK: whoever reaches ")


def test_a_lease_is_within_limits() -> None:
    """Shorter than its keep-alive messages take it would end every link."""
    assert network_of(parse("--lease-ms", "10000")).lease_ms == 10_000
    for lease in ("499", "600001", "-1"):
        with pytest.raises(UsageError, match=f"--lease-ms {lease}"):
            network_of(parse("--lease-ms", lease))


def test_processes_of_this_machine_need_no_switch(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nor do members of a deployment, wherever they are."""
    monkeypatch.delenv("CRCOLONY_OPEN_NETWORK", raising=False)
    network_of(parse("--connect", "tcp/127.0.0.1:7000"))
    network = network_of(parse("--connect", "tls/10.0.0.1:7447", "--credentials", "here"))
    assert network.credentials == Path("here")
    assert network_of(parse("--credentials", "here")).connect == (HERE_ENCRYPTED,)
    with pytest.raises(NetworkError, match="with credentials every endpoint is tls"):
        network_of(parse("--connect", A, "--credentials", "here"))


def test_the_clock_is_real_time_unless_another_is_chosen() -> None:
    """Given as control periods per second, as a multiple of real time, or as lockstep, which has no period."""
    assert wall_period_s(parse(), 0.1) == 0.1
    assert wall_period_s(parse("--hz", "20"), 0.1) == 0.05
    assert wall_period_s(parse("--speed", "4"), 0.1) == 0.025
    assert wall_period_s(parse("--lockstep"), 0.1) is None


@pytest.mark.parametrize("name", ["", "a/b", "a b", "ä", "*", "x" * 65])
def test_names_that_cannot_be_in_a_key_expression_are_refused(name: str) -> None:
    """Of colonies and of arenas."""
    check_names(parse("--colony", "reds_1.a-b", "--arena", "x" * 64))
    for option in ("--colony", "--arena"):
        with pytest.raises(UsageError, match=option):
            check_names(parse(option, name))


def test_an_arena_has_a_slot_for_every_robot() -> None:
    """Without --robots it has as many as robots, and some to spare."""
    assert _config().robots == 5
    assert _config("-n", "4").robots == 6
    assert _config("-n", "3", "--robots", "4").robots == 4
    with pytest.raises(UsageError, match="the arena has 2 slots"):
        _config("-n", "3", "--robots", "2")
