"""QEMU as a process: its monitor (QMP) on the standard streams, serial lines as pseudo-terminals, and its debugger."""

import json
import os
import queue
import re
import socket
import subprocess
import tempfile
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO

from tests.robot_firmware_bridge.printed_lines import end_process

_ANSWERS_WITHIN_S = 10.0


class Qemu:
    """A machine that is paused until `resume`. `on_event` is called with what happens to it, and when (s).

    Its serial lines are pseudo-terminals of ours, which `lines` names: with its own QEMU looks only once a second
    whether anybody is there. They are held open, so that a controller may come and go; but one that is gone for long
    must come back or end the machine, which waits when a line is full.
    """

    def __init__(
        self, machine: list[str], serial_lines: int, on_event: Callable[[str, float], None]
    ) -> None:
        self._on_event = on_event
        self._answers: queue.Queue[dict[str, Any]] = queue.Queue()
        self._asking = threading.Lock()
        self._folder = tempfile.TemporaryDirectory(prefix="qemu-")  # short: a socket's path is
        self._debug_path = Path(self._folder.name) / "gdb"
        pairs = [os.openpty() for _ in range(serial_lines)]
        self._held = [follower for _, follower in pairs]
        self.lines = [Path(os.ttyname(follower)) for follower in self._held]
        command = [
            *("setpriv", "--pdeathsig", "KILL"),  # ends with the tests, however they end
            *("qemu-system-arm", "-nodefaults", "-display", "none", "-nic", "none", "-S"),
            *("-qmp", "stdio", "-gdb", "chardev:gdb"),
            *("-chardev", f"socket,id=gdb,path={self._debug_path},server=on,wait=off"),
            *machine,
        ]
        for number, (leader, _) in enumerate(pairs):
            command += ["-add-fd", f"fd={leader},set={number}", "-serial", f"chardev:line{number}"]
            command += ["-chardev", f"serial,id=line{number},path=/dev/fdset/{number}"]
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            bufsize=1,
            pass_fds=[leader for leader, _ in pairs],
        )
        for leader, _ in pairs:
            os.close(leader)
        self._reading = threading.Thread(target=self._read, daemon=True)
        self._reading.start()
        self.command("qmp_capabilities")

    def command(self, name: str, **arguments: object) -> Any:
        """Return what the monitor answers to a command."""
        with self._asking:
            assert self._process.stdin is not None
            self._process.stdin.write(json.dumps({"execute": name, "arguments": arguments}) + "\n")
            answer = self._answers.get(timeout=_ANSWERS_WITHIN_S)
        assert "return" in answer, answer
        return answer["return"]

    def resume(self) -> None:
        """Let the machine run."""
        self.command("cont")

    def words(self, address: int, count: int) -> list[int]:
        """Return 32-bit words of the machine's memory, which goes on running."""
        text = self.command(
            "human-monitor-command", **{"command-line": f"xp /{count}xw {address:#x}"}
        )
        return [int(word, 16) for word in re.findall(r"0x([0-9a-f]{8})", text)]

    def debug(self, writes: dict[int, bytes], program_counter: int | None = None) -> None:
        """Pause the machine, write its memory, and perhaps let it go on elsewhere."""
        with socket.socket(socket.AF_UNIX) as debugger, debugger.makefile("rb") as answers:
            debugger.settimeout(_ANSWERS_WITHIN_S)
            debugger.connect(str(self._debug_path))

            def ask(request: str) -> str:
                check = sum(request.encode()) % 256
                debugger.sendall(f"+${request}#{check:02x}".encode())
                return _answer(answers)

            for address, data in writes.items():
                assert ask(f"M{address:x},{len(data):x}:{data.hex()}") == "OK"
            if program_counter is not None:
                ask("qXfer:features:read:target.xml:0,ffb")  # before it, registers are refused
                assert ask(f"Pf={program_counter.to_bytes(4, 'little').hex()}") == "OK"
            assert ask("D") == "OK"

    def end(self) -> None:
        """Kill the machine: its lines go, as when a cable is pulled."""
        end_process(self._process, self._reading)
        for held in self._held:
            os.close(held)
        self._folder.cleanup()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            message = json.loads(line) if line.startswith("{") else {}
            if "event" in message:
                at = message["timestamp"]
                self._on_event(message["event"], at["seconds"] + at["microseconds"] * 1e-6)
            elif "return" in message or "error" in message:
                self._answers.put(message)


def _answer(answers: BinaryIO) -> str:
    """Return the next packet of the GDB remote protocol that does not merely say that the machine has stopped."""
    packet = ""
    while not packet or packet.startswith("T"):
        while (byte := answers.read(1)) != b"$":
            assert byte, "the debugger is gone"
        packet = ""
        while (byte := answers.read(1)) != b"#":
            packet += byte.decode("latin-1")
        answers.read(2)
    return packet
