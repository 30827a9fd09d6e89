"""Benches that are programs of Node.js, with pseudo-terminals as their links."""

import os
import subprocess
import tty
from abc import abstractmethod
from pathlib import Path

from tests.robot_firmware_bridge.emulated_robot import BenchProcess


class NodeBench(BenchProcess):
    """A bench that has its links as file descriptors 3 and following."""

    has_blocking_links = True
    """Whether the bench, when it reads a link, waits for what is to come"""
    _held: "list[int]"
    """The sides of the host, so that it may come and go"""

    @abstractmethod
    def _links(self) -> list[Path]:
        """Return the links that a host opens."""

    @abstractmethod
    def _command(self) -> list[str]:
        """Return the program and its arguments."""

    def _launch(self) -> "subprocess.Popen[str]":
        links = self._links()
        pairs = [os.openpty() for _ in links]
        leaders, self._held = [leader for leader, _ in pairs], [host for _, host in pairs]
        for link, host in zip(links, self._held, strict=True):
            link.unlink(missing_ok=True)
            link.symlink_to(os.ttyname(host))
            tty.setraw(host)
        for leader in leaders:
            os.set_blocking(leader, self.has_blocking_links)
        moved = " ".join(f"{k}<&{leader} {k}>&{leader}" for k, leader in enumerate(leaders, 3))
        shell = ["setpriv", "--pdeathsig", "KILL", "bash", "-c", f'exec node "$@" {moved}', "bench"]
        process = subprocess.Popen(
            [*shell, *self._command()],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            bufsize=1,
            pass_fds=leaders,
        )
        for leader in leaders:
            os.close(leader)
        return process

    def switch_off(self) -> None:
        """See `EmulatedRobot`."""
        super().switch_off()
        for host in self._held:
            os.close(host)
