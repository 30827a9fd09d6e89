"""How far numba is with a function is counted in the functions within it."""

import pytest

from crcolony.compile_progress import compile_progress, functions_within
from crcolony.compiled import compiled, is_switched_off
from crcolony.robot.step import step_robot, step_robots
from crcolony.world.tick import step_world

pytestmark = pytest.mark.skipif(is_switched_off(), reason="nothing is compiled here")


@compiled
def half(x: float) -> float:
    return 0.5 * x


@compiled
def quarter(x: float) -> float:
    return half(half(x))


def test_the_functions_within_are_those_that_are_called_at_any_depth() -> None:
    """Each once, in other modules too; the world is not within a robot."""
    assert {function.__name__ for function in functions_within(quarter)} == {"half", "quarter"}
    robot, robots, world = map(functions_within, (step_robot, step_robots, step_world))
    assert {function.__module__ for function in robot} > {
        "crcolony.robot.step",
        "crcolony.learning.traces",
    }
    assert robot < robots
    assert len(world) > 20
    assert not {f for f in robot if f.__module__.startswith("crcolony.world")}


def test_progress_goes_from_none_to_all(tmp_path: object, monkeypatch: pytest.MonkeyPatch) -> None:
    """And nothing is reported where all is compiled already."""
    import numba

    for function in (half, quarter):  # compiled for this test, not loaded from a cache
        function.__dict__["dispatcher"] = numba.njit(function.py_func)  # type: ignore[attr-defined]
    reports = list[tuple[int, int]]()
    for _ in range(2):
        with compile_progress(lambda done, total: reports.append((done, total)), quarter):
            assert quarter(8.0) == 2.0
    assert reports[0] == (0, 2)
    assert reports[-1] == (2, 2)
    assert [done for done, _ in reports] == sorted(done for done, _ in reports)
