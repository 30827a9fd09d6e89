"""The devices of bridges are there, and may be opened by the services' user."""

import os
import pty
from pathlib import Path

from crcolony_deploy.doctor.serial_devices import check_serial_devices

from tests.support.examined_hosts import host_of, lines, service


def examine(folder: Path, address: str) -> list[str]:
    """Return what is found of a bridge with this device."""
    return lines(
        check_serial_devices(
            host_of(folder, service("bridge", "desk", f"--robot firmware@{address}"))
        )
    )


def test_a_device_that_anybody_may_open_is_well(tmp_path: Path) -> None:
    """And one that nobody may is a problem."""
    master, slave = pty.openpty()
    try:
        device = os.ttyname(slave)
        os.chmod(device, 0o666)
        assert examine(tmp_path, device) == [f"ok: {device}: user crcolony may open it"]
        os.chmod(device, 0o600)
        (found,) = examine(tmp_path, device)
        assert found.startswith(f"problem: {device}: user crcolony may not open it (group ")
    finally:
        os.close(master)
        os.close(slave)


def test_a_device_that_is_missing_or_none_is_a_problem(tmp_path: Path) -> None:
    """A robot that is unplugged, a wrong path; an address of a network is none of a file."""
    assert examine(tmp_path, "/dev/none") == ["problem: /dev/none: No such file or directory"]
    assert examine(tmp_path, str(tmp_path)) == [f"problem: {tmp_path}: is no device"]
    assert examine(tmp_path, "127.0.0.1:33333") == []
