"""The source that is uploaded: of the modules here, what a controller with nine kilobytes of memory has room for.

Docstrings, annotations and imports for them go; numbers stand where constants have names; and our own names become
short, for MicroPython keeps every name. What is imported keeps its names, and so do the attributes that are used of it
directly; of objects that it makes, no attribute may have a name of ours.
"""

import ast
import builtins
import itertools
import string
from collections.abc import Iterator
from importlib import resources

_PACKAGE = "crcolony_bridge.micropython"


def statements(paths: list[str], kept_names: set[str]) -> list[bytes]:
    """Return the source of these modules' statements as they are uploaded: imports first, then the longest first.

    A long one takes most memory while it is compiled: it comes while there is most.
    """
    folder = resources.files(_PACKAGE)
    trees = [ast.parse(folder.joinpath(path).read_text(encoding="utf-8")) for path in paths]
    found = [statement for tree in trees for statement in _Stripped().visit(tree).body]
    shortened = _Shortened(found, kept_names)
    sources = [ast.unparse(shortened.visit(statement)) for statement in found]
    sources.sort(key=lambda source: -len(source) if source.startswith(("class", "def")) else -9999)
    return [_with_narrow_indents(source).encode() for source in sources]


def _with_narrow_indents(source: str) -> str:
    lines = [(line, line.lstrip()) for line in source.splitlines() if line]
    return "\n".join(" " * ((len(line) - len(text)) // 4) + text for line, text in lines)


class _Stripped(ast.NodeTransformer):
    """Leaves out what only a reader or a type checker needs, and puts numbers where constants have names."""

    def __init__(self) -> None:
        self._constants: dict[str, ast.Constant] = {}

    def visit_Expr(self, node: ast.Expr) -> ast.Expr | None:
        self.generic_visit(node)
        return None if isinstance(node.value, ast.Constant) else node

    def visit_Assign(self, node: ast.Assign) -> ast.Assign | None:
        self.generic_visit(node)
        name, value = node.targets[0], node.value
        if isinstance(name, ast.Name) and name.id.isupper() and isinstance(value, ast.Constant):
            self._constants[name.id] = value
            return None
        return node

    def visit_Name(self, node: ast.Name) -> ast.expr:
        return self._constants.get(node.id, node)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.FunctionDef:
        self.generic_visit(node)
        node.returns = None
        node.body = node.body or [ast.Pass()]
        return node

    def visit_arg(self, node: ast.arg) -> ast.arg:
        node.annotation = None
        return node

    def visit_ImportFrom(self, node: ast.ImportFrom) -> ast.ImportFrom | None:
        is_here = (node.module or "").startswith("crcolony_bridge")  # uploaded, too
        return None if is_here or node.module == "typing" else node

    def visit_If(self, node: ast.If) -> ast.If | None:
        self.generic_visit(node)
        is_for_types = isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"
        return None if is_for_types else node


class _Shortened(ast.NodeTransformer):
    """Gives the names that these statements define short ones, the same everywhere."""

    def __init__(self, statements: list[ast.stmt], kept: set[str]) -> None:
        nodes = [node for statement in statements for node in ast.walk(statement)]
        imported = set(itertools.chain(*map(_imported_by, nodes)))
        foreign = kept | set(dir(builtins)) | imported | _attributes_of(imported, nodes)
        own = dict.fromkeys(itertools.chain(*map(_defined_by, nodes)))
        renamed = [name for name in own if name not in foreign and not name.startswith("__")]
        self._short = dict(zip(renamed, _short_names(), strict=False))

    def visit(self, node: ast.AST) -> ast.AST:
        self.generic_visit(node)
        for field in ("id", "arg", "attr", "name"):
            name = getattr(node, field, None)
            if name in self._short and not isinstance(node, ast.alias):
                setattr(node, field, self._short[name])
        return node


def _short_names() -> Iterator[str]:
    yield from string.ascii_letters
    yield from map("".join, itertools.product(string.ascii_letters, string.digits))


def _imported_by(node: ast.AST) -> list[str]:
    return [alias.name for alias in node.names] if isinstance(node, ast.ImportFrom) else []


def _attributes_of(names: set[str], nodes: list[ast.AST]) -> set[str]:
    """Return the attributes that are used of what has these names."""
    attributes = [node for node in nodes if isinstance(node, ast.Attribute)]
    return {a.attr for a in attributes if isinstance(a.value, ast.Name) and a.value.id in names}


def _defined_by(node: ast.AST) -> list[str]:
    match node:
        case ast.FunctionDef(name=name) | ast.ClassDef(name=name) | ast.arg(arg=name):
            return [name]
        case ast.Name(id=name, ctx=ast.Store()) | ast.Attribute(attr=name, ctx=ast.Store()):
            return [name]
    return []
