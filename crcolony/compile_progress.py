"""How far numba is with compiling a function: how many of the functions that it calls are done."""

import contextlib
from collections.abc import Callable, Iterator
from types import ModuleType
from typing import Any

from crcolony.compiled import Compiled, is_switched_off

Report = Callable[[int, int], None]
"""Receives how many functions are done, and of how many."""


def functions_within(*functions: Any) -> frozenset[Callable[..., Any]]:
    """Return the plain Python functions of compiled functions and of all compiled functions that they call."""
    found: set[Callable[..., Any]] = set()
    waiting = [function for function in functions if isinstance(function, Compiled)]
    while waiting:
        plain = waiting.pop().py_func
        if plain not in found:
            found.add(plain)
            waiting += _callees(plain)
    return frozenset(found)


@contextlib.contextmanager
def compile_progress(report: Report, *functions: Any) -> Iterator[None]:
    """Call `report` inside the context when numba begins with these functions, and whenever one within them is done.

    It is not called where all are compiled already. numba is imported, so this is for processes that need it.
    """
    if is_switched_off():
        yield
        return
    from numba.core import event

    expected = functions_within(*functions)
    done: set[Callable[..., Any]] = set()

    class Listener(event.Listener):
        has_begun = False

        def on_start(self, started: Any) -> None:
            if not self.has_begun and started.data["dispatcher"].py_func in expected:
                self.has_begun = True
                report(0, len(expected))

        def on_end(self, ended: Any) -> None:
            function = ended.data["dispatcher"].py_func
            if function in expected and function not in done:
                done.add(function)
                report(len(done), len(expected))

    with event.install_listener("numba:compile", Listener()):
        yield


def _callees(plain: Callable[..., Any]) -> Iterator[Compiled[..., Any]]:
    """Yield the compiled functions that a function names, directly or as an attribute of a module."""
    names = plain.__code__.co_names
    for name in names:
        value = plain.__globals__.get(name)
        if isinstance(value, Compiled):
            yield value
        elif isinstance(value, ModuleType):
            attributes = (getattr(value, attribute, None) for attribute in names)
            yield from (value for value in attributes if isinstance(value, Compiled))
