"""What is installed is what was collected, and other versions of the protocol are named."""

import importlib.metadata
from pathlib import Path

from crcolony_deploy.doctor.colony_view import ColonyView
from crcolony_deploy.doctor.versions import check_versions

from crcolony.protocol.codec import VERSION
from tests.support.examined_hosts import ADA, host_of, lines


def write_sums(folder: Path, *wheels: str) -> None:
    """Write the list of what was collected."""
    (folder / "current").mkdir()
    sums = "".join(f"{'0' * 64}  {wheel}-py3-none-any.whl\n" for wheel in wheels)
    (folder / "current/SHA256SUMS").write_text(sums)


def test_packages_are_those_that_were_collected(tmp_path: Path) -> None:
    """Of pip, which only installs, nothing is left."""
    write_sums(tmp_path, f"numpy-{importlib.metadata.version('numpy')}", "pip-1.0")
    (found,) = lines(check_versions(host_of(tmp_path)))
    assert found.endswith("2 packages as they were collected")


def test_a_package_of_another_version_is_a_warning(tmp_path: Path) -> None:
    """And one that is missing."""
    write_sums(tmp_path, "numpy-0.1", "not_there-1.0")
    assert lines(check_versions(host_of(tmp_path))) == [
        f"warning: numpy is installed as {importlib.metadata.version('numpy')}, collected was 0.1",
        "warning: not_there 1.0 is not installed",
    ]


def test_a_robot_of_another_version_of_the_protocol_is_a_problem(tmp_path: Path) -> None:
    """They cannot mate."""
    view = ColonyView(is_linked=True, other_versions={ADA: 9})
    found = lines(check_versions(host_of(tmp_path, colony=view)))
    assert found[0] == (
        f"problem: robot {ADA.hex()[:8]} speaks version 9 of the protocol, this host {VERSION}"
    )
