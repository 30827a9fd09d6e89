"""All that a host installs is collected: for its processor and its Python, from the lock, with sums."""

import hashlib
import json
import tarfile
from pathlib import Path

import pytest
from crcolony_deploy.errors import DeployError
from crcolony_deploy.wheelhouse import (
    HostKind,
    WheelhouseOptions,
    collect,
    parse_python,
    version_id,
)

from tests.support.paths import ROOT


@pytest.mark.slow
def test_wheels_are_collected_for_other_processors_than_this(tmp_path: Path) -> None:
    """For both, at the versions of the lock; every wheel fits, and every sum is right."""
    kinds = (HostKind("x86_64", "3.11"), HostKind("aarch64", "3.12"))
    lines = list[str]()
    identity = collect(WheelhouseOptions(tmp_path, ROOT, kinds, ("bridge",)), lines.append)
    manifest = json.loads((tmp_path / "manifest.json").read_text())
    assert manifest["id"] == identity
    lock = dict(
        line.split("==")
        for line in (ROOT / "requirements.lock").read_text().split()
        if "==" in line
    )
    for kind in kinds:
        names = check_archive(tmp_path / manifest["packages"][kind.tag]["file"])
        binary = [name for name in names if not name.endswith("-none-any.whl")]
        assert len(binary) >= 8
        assert all(kind.machine in name for name in binary)
        numpy = f"numpy-{lock['numpy']}-cp{kind.python.replace('.', '')}"
        assert any(name.startswith(numpy) for name in names)
        assert any(name.startswith(f"cobs-{lock['cobs']}-py3-none-any") for name in names)
    own = check_archive(tmp_path / manifest["crcolony"]["file"])
    assert [name.split("-")[0] for name in own] == ["crcolony", "pip"]


def check_archive(path: Path) -> list[str]:
    """Return the names of the wheels in an archive whose sums are right."""
    with tarfile.open(path) as tar:
        content = {member.name: tar.extractfile(member) for member in tar}
        data = {name: file.read() for name, file in content.items() if file is not None}
    sums = data.pop("SHA256SUMS").decode()
    assert sums == "".join(
        f"{hashlib.sha256(data[name]).hexdigest()}  {name}\n" for name in sorted(data)
    )
    return sorted(data)


def test_a_version_is_named_by_all_that_decides_on_it(tmp_path: Path) -> None:
    """The wheel, the lock, and the extras."""
    wheel, lock = tmp_path / "crcolony-1.2.3-py3-none-any.whl", tmp_path / "lock"
    wheel.write_bytes(b"one")
    lock.write_bytes(b"numpy==1")
    first = version_id(wheel, lock, ["bridge", "viz"])
    assert first.startswith("1.2.3+")
    assert version_id(wheel, lock, ["viz", "bridge"]) == first
    names = {first, version_id(wheel, lock, [])}
    lock.write_bytes(b"numpy==2")
    names.add(version_id(wheel, lock, ["bridge", "viz"]))
    wheel.write_bytes(b"other")
    names.add(version_id(wheel, lock, ["bridge", "viz"]))
    assert len(names) == 4


@pytest.mark.parametrize("text", ["3", "3.x", "three", "", "3.11.2"])
def test_what_is_no_version_of_python_is_refused(text: str) -> None:
    """With an example."""
    with pytest.raises(DeployError, match=r"expected a version as 3\.11"):
        parse_python(text)


def test_an_old_python_is_refused() -> None:
    """Before anything is collected for it."""
    assert parse_python("3.13") == "3.13"
    with pytest.raises(DeployError, match=r"crcolony needs 3\.11 or newer"):
        parse_python("3.9")


def test_a_folder_that_is_no_checkout_is_refused(tmp_path: Path) -> None:
    """It is named."""
    options = WheelhouseOptions(tmp_path / "out", tmp_path, (HostKind("x86_64", "3.11"),))
    with pytest.raises(DeployError, match=r"no checkout of crcolony: pyproject\.toml is missing"):
        collect(options, print)
