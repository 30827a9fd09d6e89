"""A person's first ten minutes: README's commands, typed in order into a terminal, and what is on its screen."""

import re
import shlex
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.paths import PYTHONPATH, ROOT
from tests.support.typed_terminal import Terminal

GENERATIONS = 30
"""Instead of README's 250."""


def commands_of_readme(heading: str) -> list[str]:
    """Return the commands in the first block of code under a heading, without their comments."""
    _, _, section = (ROOT / "README.md").read_text("utf-8").partition(f"## {heading}\n")
    block = section.split("```")[1]
    return [line.split("  #")[0].strip() for line in block.strip().splitlines()]


class Person:
    """Types commands into a terminal in a folder of its own."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._terminals: list[Terminal] = []

    def type(self, line: str) -> Terminal:
        """Type a command line."""
        command = line.replace("crcolony", f"{shlex.quote(sys.executable)} -P -m crcolony", 1)
        command = command.replace("--generations 250", f"--generations {GENERATIONS}")
        terminal = Terminal(command, self.folder, {"PYTHONPATH": PYTHONPATH})
        self._terminals.append(terminal)
        return terminal

    def type_and_wait(self, line: str) -> str:
        """Type a command line that ends by itself, without an error; return what it printed."""
        terminal = self.type(line)
        assert terminal.wait_for_end(300.0) == 0, terminal.screen
        return terminal.text

    def leave(self) -> None:
        for terminal in self._terminals:
            terminal.close()


@pytest.fixture
def person(tmp_path: Path) -> Iterator[Person]:
    one = Person(tmp_path)
    yield one
    one.leave()


def matings_on(screen: str) -> int:
    """Return the largest number of matings in the table of a launch."""
    lines = screen.splitlines()
    heading = next((line for line in lines if "matings" in line and "energy" in line), "")
    end = heading.find("matings") + len("matings")
    counts = [re.search(r"(\d+)$", line[:end].rstrip()) for line in lines if heading]
    return max((int(found[1]) for found in counts if found), default=0)


@pytest.mark.timeout(900)
def test_the_way_of_a_user_is_walked_as_readme_says(person: Person) -> None:
    """From a run in one process to its robots as processes, with the dashboard, and to what is left of both."""
    evolve, launch, inspect, plot, replay, experiment, export, config = commands_of_readme(
        "The way of a user"
    )
    evolved = person.type_and_wait(evolve)
    assert f"{GENERATIONS} of {GENERATIONS}" in evolved
    assert "history hash" in evolved

    live = person.type(launch)
    live.wait_for(lambda screen: re.search(r"http://\S+", screen), "the dashboard's address", 120.0)
    live.wait_for(lambda screen: matings_on(screen) > 0, "a mating", 200.0)
    live.press_ctrl_c()
    assert live.wait_for_end(60.0) == 0, live.screen
    folder = person.folder / "runs" / "1"
    assert str(Path("runs/1")) in live.text
    assert (folder / "history.sqlite").is_file()

    assert "4 robots" in person.type_and_wait(inspect)
    person.type_and_wait(plot)
    assert list((person.folder / "runs/mine/plots").glob("*.pdf"))
    person.type_and_wait(replay)
    assert (person.folder / "runs/mine/replay.rrd").is_file()
    assert "better-start" in person.type_and_wait(experiment)
    assert list((person.folder / "runs").rglob("rows.parquet"))
    person.type_and_wait(export)
    assert list((person.folder / "runs/mine").rglob("*.parquet"))
    person.type_and_wait(config)
    assert "agents = 20" in (person.folder / "my.toml").read_text("utf-8")


@pytest.mark.parametrize(
    ("typed", "answer"),
    [
        ("crcolony evolv", "evolve"),
        ("crcolony evolve --generatons 3", "--generations"),
        ("crcolony evolve --set life.agent=3", "life.agents"),
        ("crcolony launch --from runs/nothing", "runs/nothing"),
        ("crcolony inspect runs/nothing", "runs/nothing"),
        ("crcolony replay runs/nothing", "runs/nothing"),
        ("crcolony evolve --resume --out runs/nothing", "runs/nothing"),
    ],
)
def test_what_is_mistyped_is_answered_in_one_line(person: Person, typed: str, answer: str) -> None:
    """With what was meant or what is missing, and never with a traceback."""
    terminal = person.type(typed)
    assert terminal.wait_for_end(60.0) == 2, terminal.screen
    (line,) = [line for line in terminal.screen.splitlines() if line]
    assert answer in line
    assert "Traceback" not in terminal.text
