"""Compiled code is cached in a folder that changes with the sources of which it is made."""

import ast
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

import crcolony
from crcolony.compiled import (
    COMPILED_SOURCES,
    cache_folder,
    compiled,
    is_first_start,
    is_switched_off,
    source_digest,
)

PACKAGE = Path(crcolony.__file__).parent


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
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "numba"))
    assert cache_folder() == tmp_path / "numba" / source_digest(PACKAGE)
    assert is_first_start()
    cache_folder().mkdir(parents=True)
    assert not is_first_start()
    cache_folder.cache_clear()
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert cache_folder() == tmp_path / "cache" / "crcolony" / source_digest(PACKAGE)


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
