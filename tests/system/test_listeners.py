"""Every kind of process listens where docs/secure_a_colony.md says, and nowhere else."""

import re
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from crcolony.commands.deployment_options import AUTHORITY_PORT
from crcolony.protocol.identity import create_key
from crcolony.transport.network_settings import PORT
from tests.support.deployment import Deployment
from tests.support.listeners import Listener, listeners_of
from tests.support.namespaces import Host, hosts, needs_namespaces
from tests.support.paths import ROOT
from tests.support.process import Process, wait_until
from tests.support.process_colony import crcolony

pytestmark = needs_namespaces

HOST = "10.0.0.1"
SEED = f"tls/{HOST}:{PORT}"
DOCUMENT = (ROOT / "docs/secure_a_colony.md").read_text()
READY = {
    "router": "router at",
    "arena": "arena arena with",
    "bridge": "bridge lab with 1 robots",
    "host": "robots of colony",
    "robot": "has body",
    "top": "robots alive",
    "metrics": "metrics at",
    "dashboard": "dashboard at",
    "authority": "authority of colony",
}
"""What a process prints once it listens, by its command."""


def documented() -> dict[str, tuple[set[str], set[str]]]:
    """Return what stands in the table: by process, what it listens on over TCP, and over UDP."""
    found: dict[str, tuple[set[str], set[str]]] = {}
    for line in DOCUMENT.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if len(cells) == 3 and (names := re.findall(r"`crcolony ([^`]+)`", cells[0])):
            tcp, udp = (set(cell.split(", ")) - {"nothing"} for cell in cells[1:])
            found |= dict.fromkeys(names, (tcp, udp))
    return found


class Household:
    """A process of every kind on one host."""

    def __init__(self, folder: Path, host: Host) -> None:
        self.folder, self._host = folder, host
        self.words: dict[str, tuple[str, ...]] = {}
        self.processes: dict[str, Process] = {}
        deployment = Deployment(folder / "deployment")
        (folder / "big").mkdir()
        west = deployment.member("router", "west")
        main = deployment.member("arena", "main", arenas=("arena",))
        lab = deployment.member("bridge", "lab", arenas=("lab",))
        big = deployment.member("host", "big", create_key(folder / "big/key"), arenas=("big",))
        wall = deployment.member("observer", "wall")
        robots = [deployment.robot(f"robot{number}") for number in range(3)]
        deployment.distribute_roster()
        self._start("router", west, "--listen", SEED)
        self._start("arena", main, "--robots", "3", "--listen", f"tls/{HOST}:7450")
        device = ("--robot", "firmware@/dev/none", "--arena", "lab")
        self._start("bridge", lab, *device, "--listen", f"tls/{HOST}:7451")
        self._start("host", big, "-n", "1", "--arena", "big", "--listen", f"tls/{HOST}:7452")
        for robot, option in zip(robots, ("", " --client", " --interface eth0"), strict=True):
            self._start(f"robot{option}", robot[1], "--out", str(robot[0]))
        self._start("top", wall)
        self._start("metrics", wall, "--serve", f"{HOST}:9464")
        self._start("dashboard --web", wall)
        authority = str(deployment.authority.folder)
        self._start("authority serve", None, authority, "--at", f"{HOST}:{AUTHORITY_PORT}")

    def _start(self, command: str, credentials: Path | None, *options: str) -> None:
        """Start a command; the name of its row is its words up to their values."""
        name = command.removesuffix(" eth0") + (" --serve" if "--serve" in options else "")
        words = [*command.split(), *options]
        if credentials is not None:
            words += ["--credentials", str(credentials)]
            if "--interface" not in command and name != "router":
                words += ["--connect", SEED]
        if command in ("arena", "host", "dashboard --web"):
            words += ["--out", str(self.folder / f"out-{command.split()[0]}")]
        log = self.folder / f"{name.replace(' ', '_')}.log"
        self.words[name] = tuple(words)
        process = Process(crcolony(*words), log, self._host.before)
        self.processes[name] = process.start()

    def told(self, name: str, option: str) -> str:
        """Return HOST:PORT that an option of a process names; empty if there is none."""
        words = self.words[name]
        if option not in words:
            return ""
        return words[words.index(option) + 1].removeprefix("tls/")

    def describe(self, name: str, listener: Listener) -> str:
        """Return a socket in the words of the document."""
        for option in ("--listen", "--serve", "--at"):
            if self.told(name, option) == f"{listener.address}:{listener.port}":
                return f"`{option}`"
        if listener.port > 10_000:
            if listener.address == HOST:
                return "a free port"
            if listener.is_of_all_addresses:
                return "a free port of all addresses"
        address = "loopback" if listener.address == "127.0.0.1" else listener.address
        return f"{listener.port} of {address}"


@pytest.fixture(scope="module")
def household(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Household]:
    with hosts(1) as (host,):
        made = Household(tmp_path_factory.mktemp("household"), host)
        try:
            for name, process in made.processes.items():
                kind = name.split()[0]
                # By multicast nobody else is there: it waits for its arena, and listens.
                process.wait_for("waiting" if "--interface" in name else READY[kind])
            yield made
        finally:
            for process in made.processes.values():
                if process.is_running:
                    process.signal(signal.SIGTERM)
            for process in made.processes.values():
                process.wait(30.0)


def test_every_row_of_the_table_is_a_process_here(household: Household) -> None:
    """And every process here has a row."""
    assert set(documented()) == set(household.processes)
    assert f"{PORT} for `--listen`, {AUTHORITY_PORT} for `--at`, both of loopback" in DOCUMENT


@pytest.mark.parametrize("name", documented())
def test_a_process_listens_where_the_table_says(household: Household, name: str) -> None:
    """Nothing more, and nothing less."""
    tcp, udp = documented()[name]
    found: dict[str, set[str]] = {}

    def is_as_documented() -> bool:
        found.update(tcp=set(), udp=set())
        for one in listeners_of(household.processes[name].pid):
            found[one.protocol].add(household.describe(name, one))
        return found == {"tcp": tcp, "udp": udp}

    wait_until(is_as_documented, f"{name} listens on {tcp} and {udp}", 5.0)


def test_nothing_accepts_connections_on_all_interfaces(household: Household) -> None:
    """IPv4 and IPv6, whatever the table says."""
    for name, process in household.processes.items():
        accepting = [one for one in listeners_of(process.pid) if one.protocol == "tcp"]
        assert not [one for one in accepting if one.is_of_all_addresses], name


def test_what_is_told_to_listen_on_all_interfaces_does(household: Household) -> None:
    """So that the tests above would notice it."""
    words = household.words["router"]
    everywhere = [word.replace(SEED, "tls/0.0.0.0:7460") for word in words]
    process = Process(crcolony(*everywhere), household.folder / "everywhere.log")
    process.before = household.processes["router"].before
    process.start()
    try:
        process.wait_for("router at")
        assert listeners_of(process.pid) == {Listener("tcp", "0.0.0.0", 7460)}
    finally:
        process.kill()
