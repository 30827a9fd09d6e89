"""The sockets on which a process listens, read from /proc: in its network namespace, with its children."""

import contextlib
import ipaddress
import os
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import psutil

_LISTEN = "0A"
_NO_PEER = "0000"


class Listener(NamedTuple):
    """A TCP socket that accepts connections, or a UDP socket that receives from anybody."""

    protocol: str
    address: str
    port: int

    @property
    def is_of_all_addresses(self) -> bool:
        """Whether every address of the machine reaches it."""
        return ipaddress.ip_address(self.address).is_unspecified


def listeners_of(pid: int) -> set[Listener]:
    """Return what a process and its children listen on."""
    pids = [pid, *(child.pid for child in psutil.Process(pid).children(recursive=True))]
    inodes = {inode for one in pids for inode in _sockets_of(one)}
    return {
        listener
        for table in ("tcp", "tcp6", "udp", "udp6")
        for listener in _listening(Path(f"/proc/{pid}/net/{table}"), inodes)
    }


def _sockets_of(pid: int) -> Iterator[str]:
    for link in Path(f"/proc/{pid}/fd").iterdir():
        with contextlib.suppress(FileNotFoundError):  # closed meanwhile
            target = os.readlink(link)
            if target.startswith("socket:["):
                yield target[len("socket:[") : -1]


def _listening(table: Path, inodes: set[str]) -> Iterator[Listener]:
    is_tcp = table.name.startswith("tcp")
    for line in table.read_text().splitlines()[1:]:
        words = line.split()
        is_open = words[3] == _LISTEN if is_tcp else words[2].endswith(f":{_NO_PEER}")
        if words[9] in inodes and is_open:
            address, _, port = words[1].partition(":")
            yield Listener("tcp" if is_tcp else "udp", _address(address), int(port, 16))


def _address(text: str) -> str:
    """Return an address as people write it: the kernel prints words of 32 bits, each the wrong way round."""
    raw = bytes.fromhex(text)
    words = [raw[k : k + 4][::-1] for k in range(0, len(raw), 4)]
    return str(ipaddress.ip_address(b"".join(words)))
