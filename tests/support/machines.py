"""Machines on a switch: each a network namespace with a root, processes, cgroups, a systemd and an sshd of its own.

Their disks are what was written over this system's own root, on a memory disk; all of it is gone at the end.
"""

import contextlib
import os
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import psutil
import pytest

from tests.support import namespaces
from tests.support.namespaces import Host
from tests.support.paths import ROOT
from tests.support.process import wait_until

_BOOT = ROOT / "tests/support/boot_machine.sh"
_CGROUPS = Path("/sys/fs/cgroup")
_NEEDED_MB = 5_000
"""Memory for the disks of four machines, and for what runs on them."""
_TOOLS = {
    "/lib/systemd/systemd": "systemd",
    "/usr/sbin/sshd": "openssh-server",
    "/usr/bin/dbus-daemon": "dbus",
    "/usr/bin/ssh": "openssh-client",
}


def missing_requirement() -> str:
    """Return why there can be no machines here; empty if there can."""
    if reason := namespaces.missing_requirement():
        return reason
    for path, package in _TOOLS.items():
        if not Path(path).exists():
            return f"{path} is missing (Debian: {package})"
    if psutil.virtual_memory().available < _NEEDED_MB * 2**20:
        return f"machines of a test need {_NEEDED_MB} MB of memory"
    if not any(
        line.endswith("\toverlay") for line in Path("/proc/filesystems").read_text().split("\n")
    ):
        return "this kernel has no overlay file system"
    return ""


needs_machines = pytest.mark.skipif(bool(missing_requirement()), reason=missing_requirement())


@dataclass
class Machine:
    """One machine; `disk` is the folder with what was written over the root."""

    host: Host
    disk: Path
    log: Path
    _first: subprocess.Popen[bytes] | None = None
    _cgroups: list[Path] = field(default_factory=list)

    @property
    def name(self) -> str:
        """Its host name."""
        return self.disk.name

    @property
    def root(self) -> Path:
        """Its root as seen from here, while it runs."""
        return Path(f"/proc/{self.pid}/root")

    @property
    def is_running(self) -> bool:
        """Whether it is switched on."""
        return self._first is not None and self._first.poll() is None

    @property
    def pid(self) -> int:
        """Its systemd's process, as seen from here."""
        assert self._first is not None
        (systemd,) = psutil.Process(self._first.pid).children()
        return systemd.pid

    def switch_on(self) -> None:
        """Start its systemd, with the disk that it has."""
        assert not self.is_running
        for part in ("upper", "work", "root"):
            (self.disk / part).mkdir(exist_ok=True)
        self._cgroups = _make_cgroups(f"crcolony-{os.getpid()}-{self.name}")
        join = "".join(f"echo $$ >{folder}/cgroup.procs; " for folder in self._cgroups)
        inside = (
            *self.host.before, "unshare", "--pid", "--mount", "--ipc", "--uts", "--cgroup", "--fork",
            "--kill-child", "sh", str(_BOOT), str(self.disk), " ".join(_cgroup_mounts()),
        )  # fmt: skip
        with self.log.open("ab") as log:
            self._first = subprocess.Popen(
                ["sh", "-c", join + 'exec "$@"', "sh", *inside],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                start_new_session=True,
            )

    def wait_until_up(self, within_s: float = 60.0) -> None:
        """Wait until its systemd has started everything."""

        def is_up() -> bool:
            assert self.is_running, self.log.read_text(errors="replace")
            assert self._first is not None
            if not psutil.Process(self._first.pid).children():
                return False
            state = self.run("systemctl", "is-system-running", check=False).strip()
            return state in ("running", "degraded")

        wait_until(is_up, f"{self.name} is up", within_s)

    def cut_power(self) -> None:
        """End all its processes at once; its disk stays as it is."""
        if self._first is None:
            return
        with contextlib.suppress(psutil.Error, ValueError):
            os.kill(self.pid, signal.SIGKILL)  # the first of a namespace takes all others with it
        self._first.kill()
        self._first.wait()
        self._first = None
        for folder in self._cgroups:
            _remove_cgroup(folder)

    def reboot(self) -> None:
        """Cut the power, and switch it on again."""
        self.cut_power()
        self.switch_on()
        self.wait_until_up()

    def wipe(self) -> None:
        """Put in a new, empty disk, while it is off."""
        assert not self.is_running
        for part in ("upper", "work"):
            shutil.rmtree(self.disk / part)

    def run(self, *words: str, check: bool = True, within_s: float = 60.0) -> str:
        """Run a command on it as root, and return what it prints."""
        done = subprocess.run(
            ["nsenter", "-t", str(self.pid), "-m", "-u", "-i", "-n", "-p", "-C", "-r", "-w",
             "env", "-i", "PATH=/usr/sbin:/usr/bin:/sbin:/bin", *words],
            capture_output=True, text=True, timeout=within_s, check=False,
        )  # fmt: skip
        assert not check or done.returncode == 0, f"{words}: {done.stdout}{done.stderr}"
        return done.stdout


@dataclass(frozen=True)
class Lan:
    """Machines, the place from which they are set up, and the key with which it enters them."""

    machines: Sequence[Machine]
    laptop: Host
    key: Path

    def by_name(self, name: str) -> Machine:
        """Return a machine."""
        return next(machine for machine in self.machines if machine.name == name)


@contextlib.contextmanager
def machines(folder: Path, names: Sequence[str]) -> Iterator[Lan]:
    """Machines 10.0.0.1, 10.0.0.2, … that are up, and the laptop after them; all is removed at the end."""
    disks, key = folder / "disks", folder / "ssh_key"
    disks.mkdir()
    namespaces.run("ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", str(key))
    with contextlib.ExitStack() as made:
        namespaces.run("mount", "-t", "tmpfs", "-o", "mode=755", "crcolony-test", str(disks))
        made.callback(_unmount, disks)
        *hosts, laptop = made.enter_context(namespaces.hosts(len(names) + 1))
        lan = [
            Machine(host, disks / name, folder / f"{name}.boot.log")
            for name, host in zip(names, hosts, strict=True)
        ]
        for machine in lan:
            made.callback(machine.cut_power)
            _write_etc(machine, key)
            machine.switch_on()
        for machine in lan:
            machine.wait_until_up()
        yield Lan(lan, laptop, key)


def _write_etc(machine: Machine, key: Path) -> None:
    """Write what is in /etc of a new machine."""
    etc = machine.disk / "etc"
    (etc / "ssh").mkdir(parents=True)
    (etc / "hostname").write_text(machine.name + "\n")
    host_key = etc / "ssh/ssh_host_ed25519_key"
    namespaces.run("ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", str(host_key))
    public = key.with_name(key.name + ".pub").read_text()
    (etc / "ssh/authorized_keys").write_text(public)
    (etc / "ssh/sshd_config").write_text(
        f"ListenAddress {machine.host.address}\n"
        "AuthorizedKeysFile /etc/ssh/authorized_keys\nPermitRootLogin prohibit-password\n"
        "UseDNS no\nPasswordAuthentication no\nStrictModes no\n"
        "Subsystem sftp internal-sftp\n"
    )


def _cgroup_mounts() -> list[str]:
    """Return the cgroup hierarchies of this system as "TYPE:OPTIONS:FOLDER", where FOLDER is below /sys/fs/cgroup."""
    if (_CGROUPS / "cgroup.procs").exists():
        return ["cgroup2:nsdelegate:."]
    words = []
    for line in Path("/proc/self/mounts").read_text().splitlines():
        _, at, kind, options, *_ = line.split()
        if not at.startswith(f"{_CGROUPS}/"):
            continue
        name = at.removeprefix(f"{_CGROUPS}/")
        if kind == "cgroup2":
            words.append(f"cgroup2:nsdelegate:{name}")
        elif kind == "cgroup" and name != "cpuset":  # which would need to be told its processors
            own = [word for word in options.split(",") if word not in ("rw", "relatime", "nosuid")]
            own = [word for word in own if word not in ("nodev", "noexec")]
            words.append(f"cgroup:{','.join(own)}:{name}")
    return words


def _make_cgroups(name: str) -> list[Path]:
    """Make a cgroup of this name in every hierarchy, and return their folders."""
    made = []
    for word in _cgroup_mounts():
        folder = _CGROUPS / word.rsplit(":", 1)[1] / name
        folder.mkdir(exist_ok=True)
        made.append(folder)
    return made


def _remove_cgroup(folder: Path) -> None:
    """Remove a cgroup, and those in it, as soon as the last process is gone."""
    for _ in range(100):
        below = [Path(path) for path, _, _ in os.walk(folder, topdown=False)]
        with contextlib.suppress(OSError):
            for path in below:
                path.rmdir()
            return
        time.sleep(0.05)


def _unmount(folder: Path) -> None:
    subprocess.run(["umount", "--lazy", str(folder)], check=False, capture_output=True)
