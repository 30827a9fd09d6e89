"""Collects all that hosts without internet install: crcolony's own wheel and the locked ones, for each kind of host.

One archive with crcolony, and one a kind of host (processor and Python) with the packages that it needs: an upgrade
that needs the same ones copies three megabytes. Each has SHA-256 sums, which the host checks before it installs.
"""

import hashlib
import json
import os
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from crcolony_deploy.errors import DeployError

MANIFEST = "manifest.json"
SUMS = "SHA256SUMS"
LOCK = "requirements.lock"
MACHINES = ("x86_64", "aarch64")
"""Processors, as `uname -m` has them."""
_GLIBC = (*range(36, 16, -1), 12, 5)
"""Minor versions of the C library that wheels may be built for: Debian 12 has 2.36."""
_LEGACY = ("manylinux2014", "manylinux2010", "manylinux1")
_BUILD_TIME = "1577836800"
"""In wheels that are built here, so that the same sources give the same wheel."""
_OLDEST_PYTHON = (3, 11)
_WITHOUT_WHEELS = ("cobs",)
"""Locked packages of which the index has sources alone; without a compiler each becomes plain Python, for any host."""


@dataclass(frozen=True)
class HostKind:
    """What decides on the wheels of a host."""

    machine: str
    python: str
    """Its version, as 3.11"""

    @property
    def tag(self) -> str:
        """Its name in files."""
        return f"{self.machine}-cp{self.python.replace('.', '')}"


@dataclass(frozen=True)
class WheelhouseOptions:
    """What is collected."""

    folder: Path
    source: Path
    """The checkout that is deployed"""
    kinds: tuple[HostKind, ...]
    extras: tuple[str, ...] = ()


def parse_python(text: str) -> str:
    """Return a version of Python as 3.11; raises DeployError for another text, or a version that is too old."""
    parts = text.split(".")
    if len(parts) != 2 or not all(part.isascii() and part.isdigit() for part in parts):
        raise DeployError(f"Python {text!r}: expected a version as 3.11")
    if (int(parts[0]), int(parts[1])) < _OLDEST_PYTHON:
        raise DeployError(f"Python {text}: crcolony needs 3.11 or newer")
    return text


def collect(options: WheelhouseOptions, print_line: Callable[[str], None]) -> str:
    """Write the archives and their manifest; return the id of what they install. Raises DeployError."""
    for needed in ("pyproject.toml", LOCK):
        if not (options.source / needed).is_file():
            raise DeployError(f"{options.source}: no checkout of crcolony: {needed} is missing")
    options.folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=options.folder) as scratch:
        own = _build(options.source, Path(scratch) / "own")
        identity = version_id(own, options.source / LOCK, options.extras)
        built = _build_pure(options.source / LOCK, Path(scratch) / "built")
        packages = {}
        for kind in options.kinds:
            print_line(f"collecting {kind.tag}")
            wheels = Path(scratch) / kind.tag
            _download(options, kind, (own, built), wheels)
            for wheel in (*wheels.glob("crcolony-*.whl"), *wheels.glob("pip-*.whl")):
                wheel.replace(own.parent / wheel.name)
            packages[kind.tag] = _pack(wheels, options.folder, f"packages-{kind.tag}", print_line)
        crcolony = _pack(own.parent, options.folder, "crcolony", print_line)
    manifest = {
        "id": identity,
        "extras": sorted(options.extras),
        "crcolony": crcolony,
        "packages": packages,
    }
    draft = options.folder / f"{MANIFEST}.part"
    draft.write_text(json.dumps(manifest, indent=2) + "\n", "utf-8")
    draft.replace(options.folder / MANIFEST)
    return identity


def version_id(wheel: Path, lock: Path, extras: Sequence[str]) -> str:
    """Return a name for what is installed: crcolony's version, and a digest of all that decides on the rest."""
    digest = hashlib.sha256(wheel.read_bytes())
    digest.update(lock.read_bytes())
    digest.update(" ".join(sorted(extras)).encode())
    return f"{wheel.name.split('-')[1]}+{digest.hexdigest()[:10]}"


def _build(source: Path, folder: Path) -> Path:
    """Build crcolony's own wheel."""
    _pip("wheel", "--no-deps", "--wheel-dir", str(folder), str(source))
    (wheel,) = folder.glob("*.whl")
    return wheel


def _build_pure(lock: Path, folder: Path) -> Path:
    """Build wheels for any host of the packages that have none; return their folder."""
    wanted = [
        line
        for line in lock.read_text("utf-8").splitlines()
        if line.partition("==")[0] in _WITHOUT_WHEELS
    ]
    # without the cache of pip, in which such a wheel may lie that a compiler has made for this computer
    words = ("wheel", "--no-cache-dir", "--no-deps", "--wheel-dir", str(folder))
    _pip(*words, *wanted, CC="/bin/false", SOURCE_DATE_EPOCH=_BUILD_TIME)
    for wheel in folder.glob("*.whl"):
        if not wheel.name.endswith("-none-any.whl"):
            raise DeployError(f"{wheel.name}: is for one kind of host only")
    return folder


def _download(
    options: WheelhouseOptions, kind: HostKind, local: tuple[Path, Path], wheels: Path
) -> None:
    """Put all wheels of a kind of host into a folder: crcolony's, those that it needs, and pip's own.

    `local` is crcolony's wheel, and a folder with further ones.
    """
    own, built = local
    wanted = f"{own}[{','.join(options.extras)}]" if options.extras else str(own)
    platforms = [f"manylinux_2_{minor}_{kind.machine}" for minor in _GLIBC]
    platforms += [f"{legacy}_{kind.machine}" for legacy in _LEGACY]
    _pip(
        "download", "--dest", str(wheels), "--only-binary=:all:", "--implementation", "cp",
        "--python-version", kind.python,
        *(word for platform in platforms for word in ("--platform", platform)),
        "--find-links", str(built), "--constraint", str(options.source / LOCK), wanted, f"pip=={version('pip')}",
    )  # fmt: skip


def _pack(
    folder: Path, target: Path, name: str, print_line: Callable[[str], None]
) -> dict[str, str]:
    """Pack the wheels of a folder, with their sums, as a whole or not at all; return the archive's id and file.

    The id is a digest of the wheels, and a part of the file's name.
    """
    wheels = sorted(folder.glob("*.whl"))
    sums = "".join(f"{_sum_of(wheel)}  {wheel.name}\n" for wheel in wheels)
    (folder / SUMS).write_text(sums, "utf-8")
    digest = hashlib.sha256(sums.encode()).hexdigest()[:16]
    archive = target / f"{name}-{digest}.tar"
    draft = archive.with_name(f"{archive.name}.part")
    with tarfile.open(draft, "w") as tar:
        for path in (folder / SUMS, *wheels):
            tar.add(path, path.name)
    draft.replace(archive)
    print_line(f"{archive}: {len(wheels)} wheels, {archive.stat().st_size / 1e6:.0f} MB")
    return {"id": digest, "file": archive.name}


def _sum_of(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _pip(*words: str, **environment: str) -> None:
    """Run pip, with more variables in its environment. Raises DeployError with its own reason."""
    command = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", *words]
    done = subprocess.run(
        command, capture_output=True, text=True, check=False, env=os.environ | environment
    )
    if done.returncode:
        lines = [line for line in done.stderr.splitlines() if line.startswith("ERROR: ")]
        reason = lines[-1].removeprefix("ERROR: ") if lines else done.stderr.strip()[-300:]
        raise DeployError(f"pip {words[0]}: {reason}")
