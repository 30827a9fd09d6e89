"""The image of `deploy/container`, built by buildah on a base of Debian's, and commands run in it without an engine.

The base has the packages of a slim image with Python, as they are installed here: their files are copied.
"""

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
_PACKAGES = ("python3", "python3-venv", "ca-certificates", "libstdc++6")
"""What the base has besides what Debian cannot do without"""


def missing_requirement() -> str:
    """Return why no image can be built here; empty if one can."""
    if os.geteuid() != 0:
        return "images are built as root here"
    for tool in ("buildah", "unshare", "chroot", "dpkg-query", "apt-cache"):
        if shutil.which(tool) is None:
            return f"{tool} is not installed"
    for package in _PACKAGES:
        if subprocess.run(["dpkg-query", "-W", package], capture_output=True).returncode:
            return f"{package} is not installed"
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
        copy_packages(folder / "base")
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


def copy_packages(base: Path) -> None:
    """Make a root of the files of `_PACKAGES`, of essential packages, and of all that these depend on."""
    known = run("dpkg-query", "-W", "-f", "${db:Status-Abbrev}${Essential} ${Package}\n")
    is_essential = {
        name: essential == "yes"
        for status, essential, name in map(str.split, known.splitlines())
        if status == "ii"
    }
    wanted = (*_PACKAGES, *(name for name in is_essential if is_essential[name]))
    options = ("--recurse", "--installed", "--important")
    found = run("apt-cache", "depends", *options, *wanted).splitlines()
    packages = [name for name in found if name in is_essential]
    listed = run("dpkg-query", "-L", *packages).splitlines()
    files = [path for path in dict.fromkeys(listed) if path[:1] == "/" and os.path.lexists(path)]
    for name in ("bin", "sbin", "lib", "lib64"):
        (base / "usr" / name).mkdir(parents=True)
        (base / name).symlink_to(f"usr/{name}")
    (names := base.with_name("files")).write_text("\n".join(files))
    pack = f"tar -C / -c --no-recursion -T {names} | tar -C {base} -x --keep-directory-symlink"
    devices = f"cp -a /dev/null /dev/zero /dev/random /dev/urandom {base}/dev"
    users = f"cp -a /etc/passwd /etc/group {base}/etc"
    run("sh", "-c", f"{pack} && {devices} && {users} && ldconfig -r {base}")


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
