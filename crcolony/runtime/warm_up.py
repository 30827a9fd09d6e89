"""Compiles a robot's control step before its clock runs: once on a machine, however many robots start there."""

import contextlib
import fcntl
import json
from collections.abc import Iterator
from pathlib import Path

from crcolony.config import Config
from crcolony.robot.aot_step import load_step, machine_code_path
from crcolony.robot.factory import make_robots, numbered_streams
from crcolony.robot.state import Robots, StepParameters
from crcolony.runtime.startup_report import Progress, StartupReport

COMPILING_STEP = "compiling the control step"


def warm_up(robots: Robots, parameters: StepParameters, report: StartupReport) -> None:
    """Load the control step of robots, compiled first if there is none; if another process does that, wait for it."""
    path = machine_code_path(robots, parameters)
    with contextlib.ExitStack() as held:
        if path is not None and not path.exists():
            held.enter_context(_compiling(path, report))
        load_step(robots, parameters)


def load_step_if_compiled() -> None:
    """Load the control step for the robots that this process will fork, unless it has to be compiled first."""
    robots, parameters = any_robot(Config())
    path = machine_code_path(robots, parameters)
    if path is not None and path.exists():
        load_step(robots, parameters)


def any_robot(config: Config) -> tuple[Robots, StepParameters]:
    """Return what the control step of one robot depends on, which is the same for all robots of a config."""
    robots, parameters, _ = make_robots(config, ["0"], numbered_streams(0, 0, 1))
    return robots, parameters


@contextlib.contextmanager
def _compiling(path: Path, report: StartupReport) -> Iterator[None]:
    """Hold the lock of a file that is to be compiled; its progress is in the lock's file, for those that wait."""
    from crcolony.compile_progress import compile_progress
    from crcolony.robot.step import step_robot

    path.parent.mkdir(parents=True, exist_ok=True)
    progress_file, draft = path.with_suffix(".progress"), path.with_suffix(".progress-draft")

    def write_progress(done: int, total: int) -> None:
        with contextlib.suppress(OSError):  # the disk may have become full
            draft.write_text(json.dumps([done, total]))
            draft.replace(progress_file)

    report.follow(lambda: Progress(COMPILING_STEP, *_read_progress(progress_file)))
    with path.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if path.exists():
            yield
            return
        try:
            with compile_progress(write_progress, step_robot):
                yield
        finally:
            progress_file.unlink(missing_ok=True)


def _read_progress(progress_file: Path) -> tuple[int, int]:
    """Return what another process, or this one, has written; zeros before it has."""
    try:
        done, total = json.loads(progress_file.read_text())
        return int(done), int(total)
    except (OSError, ValueError, TypeError):
        return 0, 0
