"""Draw the rooms of the code into docs/architecture.md, from the imports: python docs/draw_rooms.py

A room is a package in `crcolony`, or a package beside it; an arrow says that one imports the other. An arrow is left
out where a longer way leads to the same room, and the small modules that every room uses are not drawn.
"""

import ast
from collections.abc import Iterator, Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs/architecture.md"
FOLDERS = (
    ROOT / "crcolony",
    ROOT / "dashboards/crcolony_dashboards",
    ROOT / "deploy/crcolony_deploy",
    ROOT / "robot_firmware_bridge/crcolony_bridge",
)
BEGIN = "<!-- drawn by docs/draw_rooms.py -->"
END = "<!-- end of the drawing -->"
EVERYWHERE = {
    "code_cache",
    "compile_progress",
    "compiled",
    "errors",
    "json_log",
    "randomness",
    "rate_limit",
    "shutdown",
    "terminal",
}
"""Modules at the bottom: nearly every room imports them."""

Imports = Mapping[str, set[str]]
"""Of every room, the rooms that it imports."""


def room_of(module: str) -> str:
    """Return the room of a module, "" for a module outside or one that is not drawn."""
    package, _, rest = module.partition(".")
    if package in {folder.name for folder in FOLDERS[1:]}:
        return package
    room = rest.partition(".")[0] if package == "crcolony" else ""
    return "" if room in EVERYWHERE or room.startswith("__") else room


def imported_modules(source: str) -> Iterator[str]:
    """Yield the module of every import of a file, those inside functions too."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module == "crcolony":
            yield from (f"crcolony.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module


def read_imports() -> Imports:
    """Return which room imports which, from the code."""
    rooms: dict[str, set[str]] = {}
    for folder in FOLDERS:
        for path in folder.rglob("*.py"):
            parts = path.relative_to(folder.parent).with_suffix("").parts
            room = room_of(".".join(parts))
            if room:
                imported = set(map(room_of, imported_modules(path.read_text("utf-8"))))
                rooms.setdefault(room, set()).update(imported - {room, ""})
    return rooms


def reachable(rooms: Imports, start: str, without: str) -> set[str]:
    """Return the rooms that a room imports, directly or through others, on ways that avoid one room."""
    found: set[str] = set()
    waiting = [start]
    while waiting:
        new = rooms.get(waiting.pop(), set()) - found - {without}
        found |= new
        waiting += new
    return found


def reduce(rooms: Imports) -> Imports:
    """Leave out every arrow for which there is a longer way (the transitive reduction)."""
    return {
        room: {
            target
            for target in targets
            if not any(target in reachable(rooms, other, room) for other in targets - {target})
        }
        for room, targets in rooms.items()
    }


def draw(rooms: Imports) -> str:
    """Return the rooms as a Mermaid diagram, the same text for the same imports."""
    arrows = [
        f"    {room} --> {target}"
        for room, targets in sorted(reduce(rooms).items())
        for target in sorted(targets)
    ]
    return "\n".join(["```mermaid", "flowchart TD", *arrows, "```"])


def insert(page: str, drawing: str) -> str:
    """Return the page with the drawing between its two marks; raises ValueError if they are not there."""
    before, begin, rest = page.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not (begin and end):
        raise ValueError(f"{PAGE.name}: the marks of the drawing are missing")
    return f"{before}{begin}\n{drawing}\n{end}{after}"


if __name__ == "__main__":
    PAGE.write_text(insert(PAGE.read_text("utf-8"), draw(read_imports())), "utf-8")
