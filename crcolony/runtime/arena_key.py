"""The key of an arena or a bridge, by which robots know it again: in its folder, or else in one of the user's."""

import os
import secrets
from pathlib import Path

from crcolony.protocol.identity import (
    SEED_BYTES,
    Identity,
    IdentityError,
    arena_id,
    create_key,
    load_key,
)
from crcolony.runtime.console import print_warning
from crcolony.storage.files import ARENA_KEY_FILE


def arena_identity(name: str, folder: Path | None) -> Identity:
    """Return the identity of an arena, whose key is created if it is missing. Raises IdentityError.

    Without a folder, and where the user's cannot be written, it is one for this run alone.
    """
    if folder is not None:
        return _load_or_create(folder / ARENA_KEY_FILE)
    path = _state_folder() / "arenas" / f"{name}.key"
    try:
        return _load_or_create(path)
    except IdentityError as error:
        if path.exists():
            raise
        print_warning(
            f"{error}; so this arena has a key for this run alone, and robots that know it will not live in the next"
            " one of its name: --out keeps the key"
        )
        return Identity(secrets.token_bytes(SEED_BYTES))


def format_arena_id(name: str, identity: Identity) -> str:
    """Return the line of an arena as it stands in the known_arenas of a robot that lives in it."""
    return f"known to robots as: {name} {arena_id(identity.public_key).hex()}"


def _load_or_create(path: Path) -> Identity:
    return load_key(path) if path.exists() else create_key(path)


def _state_folder() -> Path:
    """Return where programs keep what they need again (XDG base directories)."""
    state = os.environ.get("XDG_STATE_HOME")
    return (Path(state) if state else Path.home() / ".local" / "state") / "crcolony"
