"""Whether what is installed is what was collected, and whether all robots speak one version of the protocol."""

import importlib.metadata
import re
from collections.abc import Iterator

import crcolony
from crcolony.protocol.codec import VERSION
from crcolony_deploy.doctor.finding import Finding, ok, problem, warning
from crcolony_deploy.doctor.host_state import HostState
from crcolony_deploy.wheelhouse import SUMS


def check_versions(host: HostState) -> Iterator[Finding]:
    """Compare installed packages with the list of the wheelhouse, and tokens with our own version."""
    others = host.colony.other_versions
    for robot, version in sorted(others.items()):
        yield problem(
            f"robot {robot.hex()[:8]} speaks version {version} of the protocol, this host {VERSION}",
            "upgrade the older one: upgrade.yml",
        )
    if not others and host.colony.is_linked:
        yield ok(f"all speak version {VERSION} of the protocol")
    try:
        lines = (host.current / SUMS).read_text("utf-8").splitlines()
    except OSError:
        yield ok(f"crcolony {crcolony.__version__}, not installed from a wheelhouse")
        return
    differing = list(_differing(lines))
    for line in differing:
        yield warning(line, "install again: site.yml after deleting this version's folder")
    if not differing:
        yield ok(f"crcolony {crcolony.__version__}, {len(lines)} packages as they were collected")


def _differing(lines: list[str]) -> Iterator[str]:
    for line in lines:
        match = re.fullmatch(r"[0-9a-f]{64}  ([^-]+)-([^-]+)-.*\.whl", line)
        if match is None or match[1] == "pip":
            continue
        try:
            found = importlib.metadata.version(match[1])
        except importlib.metadata.PackageNotFoundError:
            yield f"{match[1]} {match[2]} is not installed"
            continue
        if found != match[2]:
            yield f"{match[1]} is installed as {found}, collected was {match[2]}"
