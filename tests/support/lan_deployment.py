"""A deployment of a test: an inventory of machines, the playbooks run against them over ssh, and what came of it."""

import contextlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import yaml  # type: ignore[import-untyped]

from tests.support.deployment import Deployment as CertifiedColony
from tests.support.machines import Lan
from tests.support.paths import PYTHONPATH, ROOT
from tests.support.process import PATIENCE_S, Process, wait_until
from tests.support.process_colony import BUSY

SEED = "tls/10.0.0.1:7447"
PLAYBOOKS = ROOT / "deploy/ansible"
_RECAP = re.compile(
    r"^(\S+) +: ok=\d+ +changed=(\d+) +unreachable=(\d+) +failed=(\d+) +skipped=\d+ +rescued=(\d+)",
    re.MULTILINE,
)


@dataclass(frozen=True)
class HostResult:
    """What a playbook did on one host."""

    changed: int
    is_unreachable: bool
    has_failed: bool
    is_rescued: bool


@dataclass(frozen=True)
class Played:
    """The end of a playbook."""

    code: int
    output: str

    @property
    def hosts(self) -> dict[str, HostResult]:
        """What was done on each host that was reached for."""
        return {
            name: HostResult(int(changed), unreachable != "0", failed != "0", rescued != "0")
            for name, changed, unreachable, failed, rescued in _RECAP.findall(self.output)
        }


@dataclass
class Deployment:
    """An inventory for a LAN, and its playbooks. `hosts` may be changed before one is run."""

    lan: Lan
    folder: Path
    ansible_home: Path
    hosts: dict[str, dict[str, Any]] = field(default_factory=dict)
    wheelhouse: str = "wheelhouse"

    @cached_property
    def certified(self) -> CertifiedColony:
        """The authority, which is on the laptop."""
        return CertifiedColony(self.folder, "reef")

    @cached_property
    def observer(self) -> tuple[str, ...]:
        """Options with which the laptop watches the colony."""
        credentials = self.certified.member("observer", "laptop")
        return ("--connect", SEED, "--credentials", str(credentials))

    @property
    def inventory(self) -> Path:
        """The file."""
        return self.folder / "inventory.yml"

    def write(self, hosts: dict[str, dict[str, Any]] | None = None) -> Path:
        """Write the inventory, with these hosts or its own."""
        assert self.observer  # admitted before the others learn who is
        settings = dict(setting.split("=", 1) for setting in BUSY)
        settings.pop("generations")
        variables = {
            "ansible_user": "root",
            "ansible_ssh_private_key_file": str(self.lan.key),
            "ansible_ssh_common_args": "-o StrictHostKeyChecking=no -o UserKnownHostsFile=/dev/null"
            " -o ConnectTimeout=3",
            "ansible_python_interpreter": "/usr/bin/python3",
            "crcolony_colony": "reef",
            "crcolony_topology": "seeds",
            "crcolony_seeds": ["field"],
            "crcolony_authority": str(self.certified.authority.folder),
            "crcolony_wheelhouse": self.wheelhouse,
            "crcolony_settings": {key: yaml.safe_load(value) for key, value in settings.items()},
        }
        content = {"colony": {"vars": variables, "hosts": hosts or self.hosts}}
        self.inventory.write_text(yaml.safe_dump(content), "utf-8")
        return self.inventory

    def play(self, playbook: str, *options: str) -> Played:
        """Run a playbook from the laptop; what it prints is in `playbooks.log`, too, with seconds."""
        command = [
            *self.lan.laptop.before, sys.executable, "-m", "ansible", "playbook",
            "-i", str(self.inventory), str(PLAYBOOKS / f"{playbook}.yml"), *options,
        ]  # fmt: skip
        environment = os.environ | {
            "ANSIBLE_HOME": str(self.ansible_home),
            "ANSIBLE_FORKS": "4",
            "ANSIBLE_NOCOLOR": "1",
            "ANSIBLE_LOCALHOST_WARNING": "0",
            # what ssh leaves behind ends by itself
            "ANSIBLE_SSH_ARGS": "-o ControlMaster=auto -o ControlPersist=10s",
            "LC_ALL": "C.UTF-8",
            "PYTHONPATH": PYTHONPATH,
        }
        lines: list[str] = []
        started_s = time.monotonic()
        with (
            (self.folder / "playbooks.log").open("a") as log,
            subprocess.Popen(
                command,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                stdin=subprocess.DEVNULL,
                text=True,
                env=environment,
            ) as running,
        ):
            assert running.stdout is not None
            log.write(f"===== {playbook} {' '.join(options)}\n")
            try:
                for line in running.stdout:
                    lines.append(line)
                    log.write(f"{time.monotonic() - started_s:6.1f} {line}")
            except BaseException:  # as when the time of the test is over: it would be waited for
                running.kill()
                raise
        return Played(running.returncode, "".join(lines))

    def collect(self, source: Path, name: str) -> str:
        """Collect a wheelhouse of a checkout for this kind of machine, and return the id of its version."""
        done = subprocess.run(
            [sys.executable, "-m", "crcolony", "deploy", "wheelhouse", str(self.folder / name),
             "--source", str(source), "--machine", os.uname().machine, "--extra", "deploy"],
            capture_output=True, text=True, timeout=200, check=False,
            env=os.environ | {"PYTHONPATH": PYTHONPATH},
        )  # fmt: skip
        assert done.returncode == 0, done.stdout + done.stderr
        return str(json.loads((self.folder / name / "manifest.json").read_text())["id"])

    def on_laptop(self, *words: str) -> "LaptopCommand":
        """Return a command of crcolony on the laptop, which is not started yet."""
        log = self.folder / f"laptop-{words[0]}-{time.monotonic_ns()}.log"
        command = [sys.executable, "-m", "crcolony", *words]
        return LaptopCommand(command, log, self.lan.laptop.before)

    def robots(self) -> dict[str, dict[str, Any]]:
        """Return what the laptop sees of each robot that is alive, by its id."""
        done = subprocess.run(
            [*self.lan.laptop.before, sys.executable, "-m", "crcolony", "status", "--json",
             "--seconds", "2.5", "--colony", "reef", *self.observer],
            capture_output=True, text=True, timeout=30, check=False,
            env=os.environ | {"PYTHONPATH": PYTHONPATH},
        )  # fmt: skip
        if done.returncode:
            return {}
        robots = json.loads(done.stdout)["robots"]
        return {robot["id"]: robot for robot in robots if robot["alive"] and robot.get("arena")}

    def matings_of(self, robot: str) -> int:
        """Return the matings of a robot, once the laptop sees it with a body."""
        seen: dict[str, dict[str, Any]] = {}

        def is_seen() -> bool:
            seen.update(self.robots())
            return robot in seen

        wait_until(is_seen, f"robot {robot[:8]} is seen")
        return int(seen[robot]["matings"])

    def id_of(self, name: str) -> str:
        """Return the id of the robot of this name, which its systemd knows."""
        machine = self.lan.by_name(name)
        unit = f"crcolony-robot@{name}"
        return machine.run("systemctl", "show", "-p", "StatusText", "--value", unit).split()[-1]

    def wait_for_matings(self, robots: set[str], more: int, within_s: float = PATIENCE_S) -> None:
        """Wait until each of these robots has had more matings."""
        before = self.robots()

        def have_mated() -> bool:
            now = self.robots()
            return all(
                robot in now
                and now[robot]["matings"] >= before.get(robot, {"matings": 0})["matings"] + more
                for robot in robots
            )

        wait_until(have_mated, f"{len(robots)} robots have {more} more matings", within_s)


class LaptopCommand(Process):
    """A command of the laptop."""

    def run(self) -> str:
        """Run it to its end, and return what it prints."""
        self.start()
        code = self.wait(60.0)
        assert code == 0, self.output
        return self.output


@contextlib.contextmanager
def deployment(lan: Lan, folder: Path) -> Iterator[Deployment]:
    """A deployment without hosts; the folder of Ansible's sockets has a short name, and is removed at the end."""
    home = Path(tempfile.mkdtemp(prefix="crc"))
    try:
        yield Deployment(lan, folder, home)
    finally:
        shutil.rmtree(home, ignore_errors=True)


def changed_checkout(folder: Path, version: str, *, is_broken: bool) -> Path:
    """Return a copy of this checkout with another version, in which a broken robot fails at its start."""
    ignored = shutil.ignore_patterns(
        ".*", "__pycache__", "tests", "docs", "runs", "node_modules", "firmware"
    )
    shutil.copytree(ROOT, folder, ignore=ignored)
    project = folder / "pyproject.toml"
    text = project.read_text("utf-8")
    project.write_text(
        re.sub(r'^version = ".*"', f'version = "{version}"', text, flags=re.MULTILINE), "utf-8"
    )
    if is_broken:
        start = folder / "crcolony/runtime/start_robot.py"
        start.write_text(
            start.read_text("utf-8") + '\n\nraise RuntimeError("broken by a test")\n', "utf-8"
        )
    return folder
