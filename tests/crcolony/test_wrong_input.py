"""No command answers any value of any option with a traceback: it runs, or refuses with one line and exit code 2."""

import argparse
import importlib
from collections.abc import Iterator
from pathlib import Path

import pytest

from crcolony.cli import main, make_parser
from tests.support.command_line import parsers_of_commands

WRONG = (
    "", "x", "-1", "0", "nan", "inf", "1e400", "9" * 30, "a\nb", "[1]", "*", "robots=",
    "folder", "file", "file/x", "missing", "/proc/none/x", "/dev/null", "n" * 300,
)  # fmt: skip
"""Nonsense, numbers out of every range, and paths that are missing, of another kind, or impossible."""

RUNS = {
    "crcolony.runtime.start_arena": ("run_arena", "run_router"),
    "crcolony.runtime.start_host": ("run_host",),
    "crcolony.runtime.compile_ahead": ("compile_ahead", "kept_code"),
    "crcolony.runtime.start_robot": ("run_robot",),
    "crcolony.runtime.launch": ("run_launch",),
    "crcolony.runtime.emergency_stop": ("stop_robots",),
    "crcolony_deploy.wheelhouse": ("collect",),
    "crcolony_deploy.doctor.examine": ("examine",),
    "crcolony_bridge.start_bridge": ("run_bridge",),
    "crcolony.telemetry.terminal_view": ("run_top", "run_status"),
    "crcolony.in_process.run": ("start_run",),
    "crcolony.experiments.colonies.paper3_survival": ("run_survival",),
    "crcolony.experiments.framework.run_experiment": ("run_experiment",),
    "crcolony.fault_simulation.simulate": ("simulate",),
    "crcolony_dashboards.live": ("run_dashboard",),
    "crcolony_deploy.metrics": ("print_metrics", "serve_metrics"),
}
"""What takes long, or has no end: it is not run here when all options are accepted."""

NEEDED = {
    "experiment": ["learning-ability"],
    "robot": ["--out", "robot"],
    "bridge": ["--robot", "firmware@/dev/none"],
    "keygen": ["key"],
    "audit": ["verify", "file"],
    "backup": ["folder", "--to", "backup.tar"],
    "restore": ["file", "--out", "restored"],
    "check": ["file"],
    "completion": ["bash"],
    "enroll": ["robot", "kitchen", "--out", "credentials", "--renew"],
    "authority create": ["authority"],
    "authority members": ["folder"],
    "authority invite": ["folder", "robot", "kitchen"],
    "authority serve": ["folder"],
    "authority issue": ["folder", "file", "grant"],
    "authority revoke": ["folder", "kitchen"],
    "authority reinstate": ["folder", "kitchen"],
    "authority publish": ["folder"],
    "deploy": ["check", "file"],
    **{name: ["folder"] for name in ("claims", "inspect", "export", "replay", "plot")},
}
"""Arguments without which a command cannot be."""


class AcceptedError(Exception):
    """A command has accepted its options."""


@pytest.fixture
def _nothing_runs(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def accept(*_: object, **__: object) -> None:
        raise AcceptedError

    for module, functions in RUNS.items():
        for function in functions:
            monkeypatch.setattr(importlib.import_module(module), function, accept)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").write_text("no\0thing")


def lines_with(name: str, action: argparse.Action) -> Iterator[list[str]]:
    """Yield command lines in which an option or argument of a command has every wrong value."""
    for value in WRONG if action.nargs != 0 else [""]:
        if not action.option_strings:
            yield [*name.split(), "--", value]
            continue
        option = action.option_strings[-1]
        is_flag = action.nargs == 0
        words = (
            [option] if is_flag else [f"{option}={value}"] if "--" in option else [option, value]
        )
        yield [*name.split(), *NEEDED.get(name, []), *words]


@pytest.mark.usefixtures("_nothing_runs")
@pytest.mark.parametrize("name", parsers_of_commands())
def test_no_value_of_an_option_ends_with_a_traceback(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Any exception would fail this test."""
    refused, parser = 0, make_parser()
    for action in parsers_of_commands()[name]._actions:
        for words in lines_with(name, action):
            try:
                code = main(words, parser)
            except AcceptedError:
                continue
            errors = capsys.readouterr().err
            assert code in (0, 2), words
            assert errors.count("\n") == (1 if code else 0), (words, errors)
            refused += code == 2
    takes_no_value = all(action.nargs == 0 for action in parsers_of_commands()[name]._actions)
    assert refused > 0 or takes_no_value
