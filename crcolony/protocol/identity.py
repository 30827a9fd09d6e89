"""The identity of a robot, and of an arena: its Ed25519 key (RFC 8032).

A robot's id is a hash of its public key, so no other robot can use it without the secret key. Ed25519 comes from
libsodium (PyNaCl), which signs in 31 and verifies in 65 microseconds; OpenSSL takes 45 and 110 to 140.
"""

import hashlib
import os
import secrets
import tempfile
from pathlib import Path

from nacl import bindings
from nacl.exceptions import BadSignatureError

from crcolony.durable_files import create_secret
from crcolony.errors import CrcolonyError

RobotId = bytes
"""16 bytes: BLAKE2b of the public key. It is shown as 32 hex digits, or as the first eight."""

ArenaId = bytes
"""16 bytes, of the public key of an arena or a bridge"""

ID_BYTES = 16
SEED_BYTES = 32
KEY_BYTES = 32
SIGNATURE_BYTES = 64

_OTHERS = 0o077
"""The bits of a file's mode that are for others than its owner."""


class IdentityError(CrcolonyError):
    """A key file or an allow-list cannot be used; the message names the file and the reason."""


class Identity:
    """A robot's own key pair. Raise ValueError for a seed that is not 32 bytes."""

    def __init__(self, seed: bytes) -> None:
        if len(seed) != SEED_BYTES:
            raise ValueError(f"a key's seed has {SEED_BYTES} bytes, not {len(seed)}")
        self.public_key, self._secret = bindings.crypto_sign_seed_keypair(seed)
        self.id = robot_id(self.public_key)

    def sign(self, content: bytes) -> bytes:
        """Return the signature of some content, 64 bytes."""
        signed: bytes = bindings.crypto_sign(content, self._secret)
        return signed[:SIGNATURE_BYTES]


def robot_id(public_key: bytes) -> RobotId:
    """Return the id that belongs to a public key."""
    return hashlib.blake2b(public_key, digest_size=ID_BYTES, person=b"crcolony robot").digest()


def arena_id(public_key: bytes) -> ArenaId:
    """Return the id of the arena or bridge that has a public key."""
    return hashlib.blake2b(public_key, digest_size=ID_BYTES, person=b"crcolony arena").digest()


def is_signed(content: bytes, signature: bytes, public_key: bytes) -> bool:
    """Return whether the owner of a public key signed this content."""
    try:
        bindings.crypto_sign_open(signature + content, public_key)
    except (BadSignatureError, ValueError):
        return False
    return True


def seeded(colony: str, seed: int, number: int, population: str = "") -> Identity:
    """Return the identity of a simulated robot, which colony, seed and number determine: for reproducible runs only.

    So does the digest of the population of an earlier run that the colony begins with, if there is one.

    Anyone who knows the seed knows the key. Robots that must not be impersonated get theirs from `create_key`.
    """
    return Identity(seeded_key(colony, seed, number, population))


def seeded_key(colony: str, seed: int, number: int, population: str = "") -> bytes:
    """Return the seed of a simulated robot's key, 32 bytes."""
    origin = f"\n{population}" if population else ""
    content = f"{colony}\n{seed}\n{number}{origin}".encode()
    return hashlib.blake2b(content, digest_size=SEED_BYTES, person=b"crcolony seeded").digest()


def create_key(path: Path) -> Identity:
    """Write a new secret key into a file that only its owner may read; raise IdentityError if it exists."""
    seed = secrets.token_bytes(SEED_BYTES)
    write_key(path, seed)
    return Identity(seed)


def write_key(path: Path, seed: bytes) -> None:
    """Write a key's seed as hex; raise IdentityError if the file exists or cannot be written."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise IdentityError(f"{path}: cannot be written: {error.strerror}") from None
    try:
        create_secret(path, seed.hex().encode() + b"\n")
    except FileExistsError:
        raise IdentityError(f"{path}: exists already; a key is never overwritten") from None
    except OSError as error:
        raise IdentityError(f"{path}: cannot be written: {error.strerror}") from None


def load_key(path: Path) -> Identity:
    """Read a key file; raise IdentityError if it is missing, malformed, or readable for others.

    Where the disk gives every file to everybody (FAT, a mount of Windows) it is read all the same: `key_warning`.
    """
    try:
        mode = path.stat().st_mode
        text = path.read_text("ascii").strip()
    except OSError as error:
        raise IdentityError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise IdentityError(f"{path}: not a key: expected 64 hex digits") from None
    if mode & _OTHERS and keeps_modes(path.parent):
        raise IdentityError(f"{path}: others may read this key; chmod 600 {path}")
    try:
        return Identity(bytes.fromhex(text))
    except ValueError:
        raise IdentityError(f"{path}: not a key: expected 64 hex digits") from None


def key_warning(path: Path) -> str | None:
    """Return what a person should know of a key in use: that it lies where others may read it, whatever its mode."""
    if not path.stat().st_mode & _OTHERS:
        return None
    return f"{path}: this disk keeps no permissions: whoever can read it can take this robot's identity"


def keeps_modes(folder: Path) -> bool:
    """Return whether a file that is made here for its owner alone stays so; True if none can be made."""
    try:
        with tempfile.TemporaryFile(dir=folder) as probe:
            return not os.fstat(probe.fileno()).st_mode & _OTHERS
    except OSError:
        return True


class AllowList:
    """The robots with which a robot mates: all (`permissive`), or only the listed ones (`enforce`)."""

    def __init__(self, robots: frozenset[RobotId] | None = None) -> None:
        self._robots = robots

    def __contains__(self, robot: RobotId) -> bool:
        return self._robots is None or robot in self._robots

    @property
    def listed(self) -> frozenset[RobotId] | None:
        """The robots that are listed; None: all are allowed."""
        return self._robots

    @classmethod
    def load(cls, path: Path) -> "AllowList":
        """Read a file with one robot id (32 hex digits) a line; `#` starts a comment; raise IdentityError."""
        try:
            lines = path.read_text("utf-8").splitlines()
        except (OSError, UnicodeDecodeError) as error:
            raise IdentityError(f"{path}: cannot be read: {error}") from None
        robots = set()
        for number, line in enumerate(lines, 1):
            text = line.partition("#")[0].strip()
            if not text:
                continue
            try:
                robot = bytes.fromhex(text)
            except ValueError:
                robot = b""
            if len(robot) != ID_BYTES:
                raise IdentityError(f"{path}: line {number}: not a robot id of 32 hex digits")
            robots.add(robot)
        return cls(frozenset(robots))
