"""Compiled code is cached in a folder that changes with the sources of which it is made."""

import ast
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from llvmlite import binding  # type: ignore[import-untyped]

import crcolony
from crcolony.compiled import (
    COMPILED_SOURCES,
    FloatArray,
    as_index,
    cache_folder,
    compiled,
    direct,
    is_compiled_source,
    is_first_start,
    is_switched_off,
    machine_digest,
    source_digest,
)
from tests.support.paths import ROOT

PACKAGE = Path(crcolony.__file__).parent


class Here(NamedTuple):
    """What compiled functions are passed."""

    numbers: FloatArray
    offset: float


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """Return a copy of the package's sources, which a test may change."""
    copy = tmp_path / "crcolony"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    return copy


@pytest.fixture
def _fresh_cache_folder() -> Iterator[None]:
    """Compute the folder again in a test, and after it."""
    cache_folder.cache_clear()
    yield
    cache_folder.cache_clear()


def append_line(path: Path) -> None:
    """Change a source."""
    path.write_text(path.read_text("utf-8") + "# changed\n", "utf-8")


@pytest.mark.parametrize(
    "name",
    [
        "learning/traces.py",
        "evolution/variation.py",
        "body/contract.py",
        "robot/step.py",
        "world/tick.py",
        "in_process/colony.py",
        "randomness.py",
        "compiled.py",
    ],
)
def test_a_change_of_a_compiled_source_changes_the_digest(package: Path, name: str) -> None:
    """Code that was compiled of the old source is not used any more."""
    before = source_digest(package)
    assert before == source_digest(PACKAGE)
    append_line(package / name)
    assert source_digest(package) != before


@pytest.mark.parametrize(
    "name", ["runtime/launch.py", "nodes/robot_node.py", "in_process/run.py", "cli.py"]
)
def test_a_change_elsewhere_does_not_change_the_digest(package: Path, name: str) -> None:
    """Nothing has to be compiled again."""
    before = source_digest(package)
    append_line(package / name)
    assert source_digest(package) == before


def test_every_compiled_function_is_in_a_source_of_the_digest() -> None:
    """No file of the package uses `compiled` that is not among them."""
    listed = {
        source
        for name in COMPILED_SOURCES
        for source in ((PACKAGE / name).rglob("*.py") if "." not in name else [PACKAGE / name])
    }
    for source in PACKAGE.rglob("*.py"):
        imports = [
            node
            for node in ast.walk(ast.parse(source.read_text("utf-8")))
            if isinstance(node, ast.ImportFrom)
        ]
        names = {
            alias.name
            for node in imports
            for alias in node.names
            if node.module == "crcolony.compiled"
        }
        assert "compiled" not in names or source in listed, source


@pytest.mark.usefixtures("_fresh_cache_folder")
def test_the_digest_is_in_the_path_wherever_the_cache_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In NUMBA_CACHE_DIR as in the user's cache, old machine code is never used after a change of
    sources."""
    name = f"{source_digest(PACKAGE)}-{machine_digest()}"
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "numba"))
    folder = cache_folder()
    assert folder is not None
    assert folder == tmp_path / "numba" / name
    assert is_first_start()
    (folder / "code").touch()
    assert not is_first_start()
    cache_folder.cache_clear()
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert cache_folder() == tmp_path / "cache" / "crcolony" / name


def test_code_of_another_processor_is_in_another_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    """A home on NFS, or an SD card that moves: by the processor's name, and by its features."""
    digests = {machine_digest()}
    monkeypatch.setattr(binding, "get_host_cpu_name", lambda: "cortex-a72")
    digests.add(machine_digest())

    def unknown() -> None:
        raise RuntimeError("LLVM knows no features here")

    monkeypatch.setattr(binding, "get_host_cpu_features", unknown)
    digests.add(machine_digest())
    assert len(digests) == 3


@pytest.mark.slow
def test_old_machine_code_never_runs_after_a_change_of_source(
    package: Path, tmp_path: Path
) -> None:
    """With NUMBA_CACHE_DIR set, for numba's cache and for the step that is compiled ahead of time.

    Only a function that is inlined into others is changed, and its file keeps its time and size.
    """
    program = (
        "from tests.support.small_robots import new_robots, empty_observation\n"
        "from crcolony.robot.step import step_robot\n"
        "import numpy as np\n"
        "from crcolony.body.contract import ACTION_WIDTH\n"
        "batch, parameters, (robot,) = new_robots(1)\n"
        "robot.start()\n"
        "before = robot.energy\n"
        "robot.step(empty_observation())\n"
        "middle = robot.energy\n"
        "step_robot(batch, parameters, 0, empty_observation(), np.zeros(ACTION_WIDTH))\n"
        "print(before - middle, middle - robot.energy)\n"
    )
    environment = {
        **os.environ,
        "PYTHONPATH": f"{tmp_path}:{ROOT}",
        "NUMBA_CACHE_DIR": str(tmp_path / "numba"),
        "NUMBA_DISABLE_JIT": "0",
        "PYTHONDONTWRITEBYTECODE": "1",  # Python itself goes by a file's time and size
    }

    def costs() -> list[float]:
        done = subprocess.run(
            [sys.executable, "-c", program],
            capture_output=True,
            text=True,
            env=environment,
            cwd=tmp_path,
        )
        assert done.returncode == 0, done.stderr
        return [float(word) for word in done.stdout.split()]

    former = costs()
    path = package / "robot" / "energy.py"
    written = path.stat()
    source = path.read_text("utf-8")
    assert source.count("- cost, ") == 1
    path.write_text(source.replace("- cost, ", "- 9e-3, "), "utf-8")
    os.utime(path, ns=(written.st_atime_ns, written.st_mtime_ns))
    assert former == pytest.approx([1e-3, 1e-3], rel=0.5)
    assert costs() == pytest.approx([9e-3, 9e-3])


@pytest.mark.parametrize(("value", "expected"), [("", False), ("0", False), ("1", True)])
def test_compilation_is_switched_off_by_the_environment(
    value: str, expected: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Then a function stays as it is."""
    monkeypatch.setenv("NUMBA_DISABLE_JIT", value)

    def double(x: float) -> float:
        return 2.0 * x

    assert is_switched_off() == expected
    assert (compiled(double) is double) == expected


def test_a_function_that_is_called_directly_does_the_same() -> None:
    """With each kind of argument, called again and again with other values and other arrays of those types."""

    def plain(here: Here, scale: float, is_added: bool, count: int, totals: FloatArray) -> int:
        for at in range(here.numbers.shape[0]):
            value = scale * here.numbers[at] + here.offset
            totals[at] = totals[at] + value if is_added else value
        return count + 1

    function = compiled(plain)
    rng = np.random.default_rng(1)
    first = Here(rng.random(3), 0.5), 2.0, True, 7, rng.random(3)
    called = direct(function, *first)
    for size in (3, 1, 8, 0):
        for is_added in (True, False):
            here = Here(rng.random(size), rng.random())
            totals = rng.random(size)
            others, plain_ones = totals.copy(), totals.copy()
            arguments = here, rng.random(), is_added, int(rng.integers(100))
            assert called(*arguments, totals) == function(*arguments, others)
            plain(*arguments, plain_ones)
            assert np.array_equal(totals, others)
            assert np.allclose(totals, plain_ones, rtol=1e-15)


def test_a_function_that_is_not_compiled_is_called_as_it_is() -> None:
    """Where compilation is switched off."""

    def double(x: float) -> float:
        return 2.0 * x

    assert direct(double, 1.0) is double


def test_an_index_is_the_number_itself() -> None:
    """An integer, or a float that holds one, is the same element of an array as an index."""
    elements = np.arange(5.0)
    for number in (0, 3, 4.0, np.int64(2)):
        assert elements[as_index(number)] == number


@pytest.mark.parametrize(
    ("module", "expected"),
    [
        ("crcolony.learning.traces", True),
        ("crcolony.in_process.colony", True),
        ("crcolony.randomness", True),
        ("crcolony.in_process.run", False),
        ("crcolony.experiments.taxi", False),
        ("tests.benchmarks.bench_colony", False),
        ("learning.traces", False),
    ],
)
def test_sources_of_compiled_code_are_told_by_the_name_of_their_module(
    module: str, expected: bool
) -> None:
    """Only of these the digest is in the name of the cache's folder."""
    assert is_compiled_source(module) == expected
