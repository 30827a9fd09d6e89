"""The services of a host are known by the files with their options."""

from pathlib import Path

import pytest
from crcolony_deploy.doctor.installed_services import network_of_services, read_services
from crcolony_deploy.errors import DeployError

from tests.support.examined_hosts import service

SEED = "tcp/10.0.0.1:7447"


def test_services_are_read_with_their_options(tmp_path: Path) -> None:
    """Other files are none."""
    options = f"--colony reef --connect {SEED} --listen tcp/10.0.0.2:7448"
    (tmp_path / "robot-ada.env").write_text(f"# a comment\nOPTIONS={options}\n")
    (tmp_path / "other.env").write_text("OPTIONS=--x\n")
    (ada,) = read_services(tmp_path)
    assert (ada.kind, ada.name, ada.unit) == ("robot", "ada", "crcolony-robot@ada.service")
    assert ada.value("--colony") == "reef"
    assert ada.ports == [7448]
    assert read_services(tmp_path / "none") == []


def test_options_that_cannot_be_read_are_wrong_input(tmp_path: Path) -> None:
    """The file is named."""
    (tmp_path / "robot-ada.env").write_text("OPTIONS='\n")
    with pytest.raises(DeployError, match="robot-ada"):
        read_services(tmp_path)


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (f"--connect {SEED}", ("peer", (SEED,), "")),
        (f"--client --connect {SEED}", ("client", (SEED,), "")),
        ("--interface eth0 --listen tcp/10.0.0.2:7447", ("peer", (), "eth0")),
        (f"--listen {SEED}", ("peer", (SEED,), "")),
    ],
)
def test_the_colony_is_reached_as_the_services_do(
    options: str, expected: tuple[str, tuple[str, ...], str]
) -> None:
    """The first service of a seed is reached itself."""
    network = network_of_services([service("arena", "pond", options)])
    assert (network.role, network.connect, network.interface) == expected


def test_the_colony_is_reached_with_the_credentials_of_a_service() -> None:
    """Whichever way it is reached."""
    secured = "--credentials /etc/crcolony/credentials"
    for options in (f"--connect {SEED}", "--interface eth0", f"--listen {SEED}", "--client"):
        found = service("robot", "ada", f"{secured} {options}")
        network = network_of_services([found])
        assert network.credentials == found.credentials == Path("/etc/crcolony/credentials")
    assert service("router", "west", secured).network.role == "router"
