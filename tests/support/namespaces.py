"""Hosts on a switch of their own: network namespaces with cables that can be cut and can lose packets."""

import contextlib
import ctypes
import os
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest

_CLONE_NEWNET = 0x40000000


def run(*words: str) -> None:
    """Run a command; raises CalledProcessError with its output."""
    subprocess.run(words, check=True, capture_output=True, text=True, timeout=30)


def missing_requirement() -> str:
    """Return why there can be no namespaces here; empty if there can."""
    if os.geteuid() != 0:
        return "network namespaces need root"
    for tool in ("ip", "iptables"):
        if shutil.which(tool) is None:
            return f"{tool} is not installed (Debian: iproute2, iptables)"
    name = f"{os.getpid()}-probe"
    try:
        run("ip", "netns", "add", name)
        run("ip", "netns", "delete", name)
    except subprocess.CalledProcessError as error:
        return f"ip netns does not work here: {error.stderr.strip()}"
    return ""


needs_namespaces = pytest.mark.skipif(bool(missing_requirement()), reason=missing_requirement())


def enter(name: str) -> None:
    """Put the calling thread, and those that it starts from now on, into a namespace; raises OSError."""
    libc = ctypes.CDLL(None, use_errno=True)
    with Path("/run/netns", name).open("rb") as namespace:
        if libc.setns(namespace.fileno(), _CLONE_NEWNET) != 0:
            error = ctypes.get_errno()
            raise OSError(error, os.strerror(error), name)


@dataclass(frozen=True)
class Host:
    """A namespace with one network card, `eth0`."""

    name: str
    address: str
    switch: str
    port: str

    @property
    def before(self) -> tuple[str, ...]:
        """What is put in front of a command to run it there."""
        return ("ip", "netns", "exec", self.name)

    def cut(self) -> None:
        """Pull the cable at the switch."""
        run("ip", "-n", self.switch, "link", "set", self.port, "down")

    def mend(self) -> None:
        """Plug it in again."""
        run("ip", "-n", self.switch, "link", "set", self.port, "up")

    def plug_into(self, bridge: str) -> None:
        """Plug the cable into one of the two bridges of the switch: `left` or `right`."""
        run("ip", "-n", self.switch, "link", "set", self.port, "master", bridge)

    def ignore(self, other: "Host") -> None:
        """Drop all packets of one other host, until the next call of `lose`."""
        run(*self.before, "iptables", "-A", "INPUT", "-s", other.address, "-j", "DROP")

    def lose(self, share: float) -> None:
        """Drop this share of the packets that arrive here; outbound ones are not touched."""
        run(*self.before, "iptables", "-F", "INPUT")
        if share > 0.0:
            run(
                *self.before, "iptables", "-A", "INPUT", "-i", "eth0", "-m", "statistic",
                "--mode", "random", "--probability", f"{share:.3f}", "-j", "DROP",
            )  # fmt: skip


@contextlib.contextmanager
def hosts(count: int, first: int = 1) -> Iterator[Sequence[Host]]:
    """Hosts 10.0.0.1, 10.0.0.2, … on one switch; they are removed at the end of the context."""
    switch = f"{os.getpid()}-switch"
    made = [
        Host(f"{os.getpid()}-host{number}", f"10.0.0.{number}", switch, f"port{number}")
        for number in range(first, first + count)
    ]
    try:
        run("ip", "netns", "add", switch)
        for bridge in ("left", "right"):
            run("ip", "-n", switch, "link", "add", bridge, "type", "bridge")
            run("ip", "-n", switch, "link", "set", bridge, "up")
        for host in made:
            _add(host)
        yield made
    finally:
        for name in (*(host.name for host in made), switch):
            subprocess.run(["ip", "netns", "delete", name], capture_output=True, check=False)


def _add(host: Host) -> None:
    run("ip", "netns", "add", host.name)
    run(
        "ip", "-n", host.switch, "link", "add", host.port, "type", "veth",
        "peer", "name", "eth0", "netns", host.name,
    )  # fmt: skip
    host.plug_into("left")
    host.mend()
    for device in ("lo", "eth0"):
        run("ip", "-n", host.name, "link", "set", device, "up")
    run("ip", "-n", host.name, "address", "add", f"{host.address}/24", "dev", "eth0")
    run("ip", "-n", host.name, "route", "add", "224.0.0.0/4", "dev", "eth0")
