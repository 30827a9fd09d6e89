"""Where compiled code is kept between two starts, whatever the disks of this machine allow.

The user's cache, or NUMBA_CACHE_DIR; where nothing can be written there (a container without a home, a disk that is
read-only or full) a temporary folder, into which what the cache holds is copied first; or else nowhere.
"""

import contextlib
import fcntl
import os
import shutil
import stat
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

_NEEDED_BYTES = 32 * 2**20
"""Free space without which nothing new is kept: all compiled code takes 8 MB."""
_TEMPORARY_FOLDERS = ("/tmp", "/var/tmp", "/dev/shm")


def find_folder(name: str) -> Path | None:
    """Return the folder of this name in which compiled code can be kept, or None if there is none.

    Prints one line, on standard error, if it is not in the cache that is meant for it.
    """
    usual, reason = usual_root(), "there is no home folder"
    if usual is not None:
        reason = _why_unwritable(usual / name)
        if not reason:
            return usual / name
    for root in _temporary_roots():
        folder = root / name
        if usual is not None and not folder.exists():
            _copy(usual / name, folder)
        if not _why_unwritable(folder):
            _print(f"{reason}; compiled code is kept in {root}")
            return folder
    _print(f"{reason}, nor in a temporary folder; compiled code is not kept, every start compiles")
    return None


def usual_root() -> Path | None:
    """Return the root of the cache that is meant for compiled code; None if this user has no home folder."""
    if root := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(root)
    if cache := os.environ.get("XDG_CACHE_HOME"):
        return Path(cache) / "crcolony"
    try:
        return Path.home() / ".cache" / "crcolony"
    except RuntimeError:  # neither HOME nor an entry in the list of users
        return None


def guard(function: Any, folder: Path) -> None:
    """Make numba's cache of a compiled function one that never fails and that processes can share.

    numba reads its index, adds a function, and writes it back: two processes that do so at once would each give their
    code the same file. A file that a power cut has damaged is replaced.
    """
    cache = function._cache
    load, save = cache.load_overload, cache.save_overload

    def load_undamaged(signature: Any, context: Any) -> Any:
        try:
            return load(signature, context)
        except Exception:  # whatever a damaged pickle raises
            return None

    def save_alone(signature: Any, code: Any) -> None:
        # RuntimeError: numba has lost the code, as when Ctrl-C arrives while LLVM calls it back
        with contextlib.suppress(OSError, RuntimeError), _locked(folder):
            try:
                cache._cache_file._load_index()
            except Exception:  # the index is damaged: nobody can read it, so nobody misses it
                cache.flush()
            save(signature, code)

    cache.load_overload, cache.save_overload = load_undamaged, save_alone


def share_between_installations(function: Any, folder: Path) -> None:
    """Let all installations of the same sources use the same code, so that an upgrade of others compiles nothing.

    By itself numba keeps code apart by the place and the time of its source file. `folder` has a digest of all sources
    in its name.
    """
    from numba.core.caching import IndexDataCacheFile

    cache, module = function._cache, function.py_func.__module__
    own = folder / module.removeprefix("crcolony.")
    with contextlib.suppress(OSError):  # then nothing is found there, and nothing kept
        own.mkdir(exist_ok=True)
    cache._cache_path = str(own)
    files: Any = IndexDataCacheFile
    cache._cache_file = files(str(own), cache._impl.filename_base, folder.name)


def _why_unwritable(folder: Path) -> str:
    """Return why nothing can be kept in a folder, which is made if it is missing; "" if it can."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as probe:
            probe.write(b"0")
        is_filled = any(folder.iterdir())
        if not is_filled and shutil.disk_usage(folder).free < _NEEDED_BYTES:
            return f"{folder.parent}: the disk is full"
    except OSError as error:
        return f"{folder.parent}: cannot be written: {error.strerror}"
    return ""


def _temporary_roots() -> Iterator[Path]:
    """Yield folders of this user among those for temporary files; they are made if they are missing.

    Machine code is executed: a folder that another user has made, or could write to, is not used.
    """
    for parent in (os.environ.get("TMPDIR"), *_TEMPORARY_FOLDERS):
        if not parent:
            continue
        folder = Path(parent) / f"crcolony-{os.getuid()}"
        with contextlib.suppress(OSError):
            with contextlib.suppress(FileExistsError):
                folder.mkdir(mode=0o700)
            found = folder.lstat()
            is_own = stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid()
            if is_own and not found.st_mode & 0o022:
                yield folder


def _copy(source: Path, folder: Path) -> None:
    """Copy a cache that can be read and not written, as a whole or not at all."""
    draft = folder.with_name(f"{folder.name}.{os.getpid()}.part")
    with contextlib.suppress(OSError):
        try:
            if any(source.iterdir()):
                shutil.copytree(source, draft)
                draft.rename(folder)
        finally:
            shutil.rmtree(draft, ignore_errors=True)


@contextlib.contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Hold, inside the context, the right to write to a cache; where a disk has no locks there is none."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        with contextlib.suppress(OSError):
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def _print(line: str) -> None:
    print(f"crcolony: {line}", file=sys.stderr)
