"""The image of `deploy/container`, built by buildah on a base of Debian's, and commands run in it without an engine."""

import contextlib
import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.paths import ROOT

_BASE, _IMAGE = "localhost/crcolony-test-base", "localhost/crcolony-test"
USER = 10001


def missing_requirement() -> str:
    """Return why no image can be built here; empty if one can."""
    if os.geteuid() != 0:
        return "images are built as root here"
    for tool in ("buildah", "debootstrap", "unshare", "chroot"):
        if shutil.which(tool) is None:
            return f"{tool} is not installed"
    return ""


needs_buildah = pytest.mark.skipif(bool(missing_requirement()), reason=missing_requirement())


def run(*words: str | Path, timeout_s: float = 300.0) -> str:
    """Run a command and return what it prints; fails with what it complains about."""
    done = subprocess.run(
        [str(word) for word in words], capture_output=True, text=True, timeout=timeout_s, cwd=ROOT
    )
    assert done.returncode == 0, f"{words[0]}: {done.stdout[-2000:]}{done.stderr[-2000:]}"
    return done.stdout.strip()


@contextlib.contextmanager
def built_image() -> Iterator[Path]:
    """Build the image, and yield the folder of its root; everything is removed afterwards."""
    with contextlib.ExitStack() as made:
        folder = Path(made.enter_context(tempfile.TemporaryDirectory(dir="/var/tmp")))
        run(
            "debootstrap", "--variant=minbase", "--include=python3,python3-venv,ca-certificates",
            "bookworm", folder / "base", "http://deb.debian.org/debian",
        )  # fmt: skip
        scratch = run("buildah", "from", "scratch")
        made.callback(run, "buildah", "rm", scratch)
        run("buildah", "add", "-q", scratch, folder / "base", "/")
        run("buildah", "commit", "-q", scratch, _BASE)
        made.callback(run, "buildah", "rmi", "-f", _BASE)
        run(
            "buildah", "bud", "--isolation", "chroot", "-q", "-t", _IMAGE,
            "-f", "deploy/container/Containerfile", "--build-arg", f"BASE={_BASE}",
            "--volume", "/etc/ssl/certs:/etc/ssl/certs:ro", ".",
        )  # fmt: skip
        made.callback(run, "buildah", "rmi", "-f", _IMAGE)
        container = run("buildah", "from", "--pull-never", _IMAGE)
        made.callback(run, "buildah", "rm", container)
        root = Path(run("buildah", "mount", container))
        made.callback(run, "buildah", "umount", container)
        yield root


def inside(root: Path, memories: Path, code: Path) -> tuple[str, ...]:
    """Return what is put in front of a command to run it in the image as compose.yaml does.

    As the image's user, with a root that cannot be written, two volumes, and the host's network.
    """
    for volume in (memories, code):
        volume.mkdir(exist_ok=True)
        os.chown(volume, USER, USER)
    script = f"""set -e
mount --make-rprivate /
mount --bind {root} {root}
mount --bind {memories} {root}/var/lib/crcolony
mount --bind {code} {root}/var/cache/crcolony
mount -t tmpfs tmpfs {root}/tmp
mount -t proc proc {root}/proc
mount -o remount,ro,bind {root}
exec chroot --userspec={USER}:{USER} {root} /usr/bin/env -i PATH=/opt/crcolony/bin:/usr/bin:/bin \\
    HOME=/var/lib/crcolony NUMBA_CACHE_DIR=/var/cache/crcolony PYTHONUNBUFFERED=1 \\
    PYTHONDONTWRITEBYTECODE=1 sh -c 'cd /var/lib/crcolony && exec "$@"' sh "$@"
"""
    return ("unshare", "--mount", "sh", "-c", script, "sh")
