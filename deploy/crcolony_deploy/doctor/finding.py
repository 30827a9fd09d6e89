"""What a check has found: that all is well, or what is not, and what a person can do about it."""

from dataclasses import dataclass
from typing import Literal

Level = Literal["ok", "warning", "problem"]


@dataclass(frozen=True)
class Finding:
    """One line of the doctor."""

    level: Level
    what: str
    remedy: str = ""
    """Empty where all is well"""
    check: str = ""
    """The name of the check that found it"""


def ok(what: str) -> Finding:
    """Return that something is as it should be."""
    return Finding("ok", what)


def warning(what: str, remedy: str) -> Finding:
    """Return what does no harm yet."""
    return Finding("warning", what, remedy)


def problem(what: str, remedy: str) -> Finding:
    """Return what keeps a service from its work."""
    return Finding("problem", what, remedy)
