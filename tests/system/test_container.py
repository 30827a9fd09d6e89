"""The image runs a colony as nobody special, with a root that cannot be written; compose starts that colony."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml  # type: ignore[import-untyped]

from crcolony.cli import make_parser
from crcolony.transport.zenoh_session import free_port
from tests.support.containers import USER, built_image, inside, needs_buildah
from tests.support.paths import ROOT
from tests.support.process import Process
from tests.support.process_colony import settings

COMPOSE = ROOT / "deploy/container/compose.yaml"


def services() -> dict[str, dict[str, Any]]:
    """Return the services of the compose file."""
    loaded: dict[str, dict[str, Any]] = yaml.safe_load(COMPOSE.read_text())["services"]
    return loaded


def test_every_service_is_confined() -> None:
    """No root, no capabilities, a root that cannot be written, and limits on memory and processes."""
    for name, service in services().items():
        assert service["read_only"] is True, name
        assert service["user"] == f"{USER}:{USER}", name
        assert service["cap_drop"] == ["ALL"], name
        assert "no-new-privileges:true" in service["security_opt"], name
        assert service["mem_limit"], name
        assert service["pids_limit"], name


def test_every_command_is_one_of_crcolony() -> None:
    """With options that it has; robots keep their memories apart, in a volume."""
    parser = make_parser()
    folders = []
    for service in services().values():
        options = parser.parse_args(service["command"])
        folders.append(str(options.out))
    assert len(set(folders)) == len(folders) == 6
    assert not any(folder.startswith("/") for folder in folders)


@pytest.fixture(scope="module")
def image() -> Iterator[Path]:
    with built_image() as root:
        yield root


@needs_buildah
@pytest.mark.timeout(600)
def test_a_colony_lives_in_containers(image: Path, tmp_path: Path) -> None:
    """An arena and two robots, each in its own root; what they write is in the volumes alone, and nobody is root."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    tmp_path.chmod(0o755)
    before = inside(image, tmp_path / "memories", tmp_path / "code")
    processes = []
    commands = {
        "arena": ["arena", *settings(), "--hz", "20", "--robots", "2", "--listen", endpoint],
        **{
            f"robot-{k}": ["robot", *settings(), "--number", str(k), "--connect", endpoint]
            for k in range(2)
        },
    }
    try:
        for name, words in commands.items():
            command = ["crcolony", *words, "--out", name]
            process = Process(command, tmp_path / f"{name}.log", before, cwd=Path("/"))
            processes.append(process.start())
        for robot in processes[1:]:
            robot.wait_for("mated with", within_s=240.0)
        for process in reversed(processes):
            process.stop()
    finally:
        for process in processes:
            if process.is_running:
                process.kill()
    written = [path for path in (tmp_path / "memories").rglob("*") if path.is_file()]
    assert {path.stat().st_uid for path in written} == {USER}
    keys = [path for path in written if path.name == "key"]
    assert len(keys) == 2
    assert all(path.stat().st_mode & 0o077 == 0 for path in keys)
    assert any((tmp_path / "code").rglob("*"))


@needs_buildah
def test_the_image_has_nothing_to_become_root_with(image: Path) -> None:
    """None of what it adds to its base has special rights, and it brings no installer."""
    added = [path for path in (image / "opt/crcolony").rglob("*") if path.is_file()]
    assert added
    assert not [path for path in added if path.stat().st_mode & 0o6000]
    assert not (image / "opt/crcolony/bin/pip").exists()
