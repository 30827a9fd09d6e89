"""The units of deploy/systemd: systemd finds nothing wrong with them, and each is shut in as far as its work allows."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.support.paths import ROOT

UNITS = ROOT / "deploy/systemd"
KINDS = ("robot", "arena", "bridge", "router", "dashboard")
MAX_EXPOSURE = 2.0

pytestmark = pytest.mark.skipif(
    shutil.which("systemd-analyze") is None, reason="systemd is not installed"
)


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A root folder in which the units are installed, with the units of this system that they refer to."""
    root = tmp_path_factory.mktemp("root")
    shutil.copytree("/usr/lib/systemd/system", root / "usr/lib/systemd/system", symlinks=True)
    shutil.copytree(UNITS, root / "etc/systemd/system")
    python = root / "opt/crcolony/current/bin/python"
    python.parent.mkdir(parents=True)
    python.write_text("#!/bin/sh\n")
    python.chmod(0o755)
    return root


def analyze(root: Path, *words: str) -> str:
    """Return what systemd-analyze prints; it must succeed."""
    done = subprocess.run(
        ["systemd-analyze", f"--root={root}", *words], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


def exposure(root: Path, unit: str) -> float:
    """Return how exposed a service is, from 0 to 10, as systemd rates it."""
    printed = analyze(root, "security", "--offline=true", unit)
    found = re.search(r"Overall exposure level for .*: ([\d.]+) ", printed)
    assert found, printed
    return float(found[1])


@pytest.mark.parametrize("kind", KINDS)
def test_systemd_finds_nothing_wrong_with_a_unit(root: Path, kind: str) -> None:
    """Not a word: an unknown setting, or a misspelt one, would be ignored at run time."""
    printed = analyze(root, "verify", f"crcolony-{kind}@one.service")
    assert "crcolony" not in printed, printed


def test_systemd_finds_nothing_wrong_with_the_slice(root: Path) -> None:
    """It holds all services together."""
    assert "crcolony" not in analyze(root, "verify", "crcolony.slice")


@pytest.mark.parametrize("kind", KINDS)
def test_a_service_is_exposed_as_little_as_promised(root: Path, kind: str) -> None:
    """At most 2.0 of 10: the drop-in that hardens all of them is in force for each."""
    assert exposure(root, f"crcolony-{kind}@one.service") <= MAX_EXPOSURE


def test_without_the_drop_in_a_service_would_be_exposed(root: Path, tmp_path: Path) -> None:
    """So that the test above can fail."""
    bare = tmp_path / "root"
    shutil.copytree(root, bare, symlinks=True)
    shutil.rmtree(bare / "etc/systemd/system/crcolony-.service.d")
    assert exposure(bare, "crcolony-robot@one.service") > MAX_EXPOSURE


@pytest.mark.parametrize("kind", KINDS)
def test_a_service_has_limits_of_its_own(kind: str) -> None:
    """Of memory and processor: none can starve the host, or the others."""
    unit = (UNITS / f"crcolony-{kind}@.service").read_text("utf-8")
    assert re.search(r"^MemoryMax=\d+[MG]$", unit, re.MULTILINE)
    assert re.search(r"^CPUQuota=\d+%$", unit, re.MULTILINE)


def test_restarts_are_bounded_and_the_watchdog_is_on() -> None:
    """A service that fails at every start does not fail for ever."""
    common = (UNITS / "crcolony-.service.d/common.conf").read_text("utf-8")
    for setting in (
        "Type=notify",
        "Restart=on-failure",
        "StartLimitBurst=5",
        "StartLimitIntervalSec=600",
        "WatchdogSec=30",
    ):
        assert f"\n{setting}\n" in common
