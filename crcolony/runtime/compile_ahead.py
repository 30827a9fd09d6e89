"""Compiles what robots and arenas of this machine will need, before any of them starts."""

from collections.abc import Callable
from pathlib import Path

from crcolony.compiled import cache_folder
from crcolony.config import load
from crcolony.errors import CrcolonyError
from crcolony.runtime.start_arena import compile_world
from crcolony.runtime.startup_report import StartupReport
from crcolony.runtime.warm_up import any_robot, warm_up


def compile_ahead(print_line: Callable[[str], None]) -> Path:
    """Compile the control step and the world, unless they are; return the folder in which the code is.

    Raises CrcolonyError if compiled code cannot be kept.
    """
    folder = kept_code()
    config = load()
    with StartupReport(lambda data: None, print_line) as report:
        warm_up(*any_robot(config), report)
        compile_world(config, report)
    return folder


def kept_code() -> Path:
    """Return the folder in which compiled code of these sources and this processor is, or will be.

    Raises CrcolonyError if none can be kept.
    """
    folder = cache_folder()
    if folder is None:
        raise CrcolonyError(
            "compiled code cannot be kept on this machine: no folder can be written"
        )
    return folder
