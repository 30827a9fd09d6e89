"""The commands of docs/secure_a_colony.md, run as they stand there, on three machines with those addresses."""

import json
import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.namespaces import Host, hosts, needs_namespaces
from tests.support.paths import ROOT
from tests.support.process import Process, wait_until
from tests.support.process_colony import crcolony

pytestmark = needs_namespaces

DOCUMENT = (ROOT / "docs/secure_a_colony.md").read_text()
BLOCKS = [
    [line for line in block.strip().splitlines() if line.startswith("crcolony ")]
    for block in re.findall(r"^```\n(.*?)^```$", DOCUMENT, re.MULTILINE | re.DOTALL)
]
CREATE, INVITE, ARENA, ROBOT, WATCH, RENEW, REVOKE = BLOCKS
DOCTOR = [line.strip() for line in DOCUMENT.splitlines() if line.startswith("    crcolony doctor")]
STAY = {
    "authority serve": "authority of colony lab at",
    "arena": "arena arena with 4 slots",
    "robot": "has body",
}
"""Commands that run until they are stopped, and what they print once they do their work."""


class Machine:
    """One of the machines of the page, with a working folder of its own."""

    def __init__(self, host: Host, folder: Path) -> None:
        self._host, self.folder = host, folder
        self.running: list[Process] = []
        folder.mkdir()

    def start(self, *words: str) -> Process:
        """Start a command."""
        log = self.folder.with_name(f"{self.folder.name}-{len(self.running)}.log")
        process = Process(crcolony(*words), log, self._host.before, self.folder)
        self.running.append(process.start())
        return process

    def type(self, line: str, invitations: dict[str, str]) -> str:
        """Type a line of the page, with the invitation that was printed; return what it prints until it has worked."""
        words = shlex.split(line)[1:]
        if "--invitation" in words:
            words[words.index("--invitation") + 1] = invitations[" ".join(words[1:3])]
        process = self.start(*words)
        sign = next((s for text, s in STAY.items() if line.startswith(f"crcolony {text} ")), "")
        if sign:
            process.wait_for(sign)
        else:
            assert process.wait(60.0) == 0, f"{line}: {process.output}"
        return process.output


class Page:
    """What has been typed so far, and where."""

    def __init__(self, folder: Path, made: dict[str, Host]) -> None:
        self.operator, self.arena, self.robot = (
            Machine(made[address], folder / name)
            for name, address in (
                ("operator", "10.0.0.5"),
                ("arena", "10.0.0.1"),
                ("robot", "10.0.0.2"),
            )
        )
        self.invitations: dict[str, str] = {}

    def type(self, machine: Machine, lines: list[str]) -> None:
        """Type lines on a machine, one after the other."""
        for line in lines:
            printed = machine.type(line, self.invitations)
            if match := re.search(r"crcolony enroll (\w+ \w+) .*--invitation (\S+)", printed):
                self.invitations[match[1]] = match[2]

    def shown(self) -> dict[str, str]:
        """Return the arena of every robot that `crcolony status` shows online, by its id."""
        (line,) = [line for line in WATCH if line.startswith("crcolony status ")]
        robots = json.loads(self.operator.type(f"{line} --json", {}))["robots"]
        return {one["id"]: one.get("arena", "") for one in robots if one["alive"]}


@pytest.fixture
def page(tmp_path: Path) -> Iterator[Page]:
    with hosts(5) as made:
        page = Page(tmp_path, {host.address: host for host in made})
        try:
            yield page
        finally:
            for machine in (page.robot, page.arena, page.operator):
                for process in machine.running:
                    if process.is_running:
                        process.kill()


def test_the_page_is_true(page: Page) -> None:
    """A robot is enrolled, gets a body, is seen by an observer, renewed, examined, and gone once it is revoked."""
    page.type(page.operator, CREATE + INVITE)
    assert set(page.invitations) == {
        "arena main", "robot kitchen", "observer wall", "operator me",
    }  # fmt: skip
    page.type(page.arena, ARENA)
    page.type(page.robot, ROBOT)
    page.type(page.operator, WATCH)
    kitchen = page.robot.running[-1]
    robot = kitchen.output.partition("robot ")[2].split()[0]
    wait_until(lambda: page.shown() == {robot: "arena"}, "the observer sees the robot in its body")
    page.type(page.robot, RENEW)
    assert "not due" in page.robot.running[-1].output
    page.type(page.robot, DOCTOR)
    assert "access control is in force" in page.robot.running[-1].output
    page.type(page.operator, REVOKE)
    revoked = page.operator.running[-1].output
    assert re.search(r"(\d+) of \1 processes that are online have it", revoked), revoked
    wait_until(lambda: page.shown() == {}, "nobody hears the robot any more", 30.0)


def test_every_command_of_the_page_is_tried() -> None:
    """None stands in it that is not typed above."""
    tried = {line for block in (*BLOCKS, DOCTOR) for line in block}
    written = {line.strip() for line in DOCUMENT.splitlines()}
    assert {line for line in written if line.startswith("crcolony ")} == tried
