"""The arenas in which a robot lives: a file with one name and id a line, as ssh has one of hosts.

The first arena of a name is trusted and written down. Where a name has several lines, each of these arenas is trusted.
"""

from pathlib import Path

from crcolony.durable_files import replace_file
from crcolony.protocol.identity import ID_BYTES, ArenaId
from crcolony.storage.files import FolderError


class KnownArenasFile:
    """The arenas of a file, which need not exist; raises FolderError if it is malformed or cannot be read."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._text = _read(path)
        self._known = _parse(path, self._text)

    def accepts(self, name: str, arena: ArenaId) -> bool:
        """Return whether an arena of this name is trusted; the first one is written down.

        Raises FolderError if that is impossible.
        """
        if name in self._known:
            return arena in self._known[name]
        self._known[name] = {arena}
        self._text += f"{name} {arena.hex()}\n"
        data = self._text.encode()
        try:
            replace_file(self._path, lambda file: file.write(data))
        except OSError as error:
            raise FolderError(f"{self._path}: cannot be written: {error.strerror}") from None
        return True


def _read(path: Path) -> str:
    try:
        text = path.read_text("utf-8")
    except FileNotFoundError:
        return ""
    except (OSError, UnicodeDecodeError) as error:
        raise FolderError(f"{path}: cannot be read: {error}") from None
    return text if text.endswith("\n") or not text else text + "\n"


def _parse(path: Path, text: str) -> dict[str, set[ArenaId]]:
    known: dict[str, set[ArenaId]] = {}
    for number, line in enumerate(text.splitlines(), 1):
        words = line.partition("#")[0].split()
        if not words:
            continue
        try:
            name, arena = words[0], bytes.fromhex(words[1])
        except (IndexError, ValueError):
            name, arena = "", b""
        if len(words) != 2 or len(arena) != ID_BYTES:
            raise FolderError(f"{path}: line {number}: not the name and id of an arena")
        known.setdefault(name, set()).add(arena)
    return known
