"""The foreign robot is what anybody could write: it has PROTOCOL.md, and nothing of ours."""

import ast
import sys
from pathlib import Path

import pytest

from tests.support.paths import ROOT

PACKAGES = {"msgpack", "nacl", "zenoh"}
FOLDER = ROOT / "tests/foreign"
MODULES = sorted(path for path in FOLDER.glob("*.py") if not path.name.startswith("test_"))


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.stem)
def test_it_imports_nothing_of_ours(path: Path) -> None:
    """Three packages that everybody has, the standard library, and its own modules."""
    for name in _imports(path):
        first, *rest = name.split(".")
        is_own = (first, *rest[:1]) == ("tests", "foreign")
        assert is_own or first in PACKAGES | sys.stdlib_module_names, name


def _imports(path: Path) -> list[str]:
    names: list[str] = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0
            assert node.module is not None
            names.append(node.module)
    return names
