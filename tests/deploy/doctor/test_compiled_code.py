"""The control step is compiled for this processor, or the next start takes minutes."""

from pathlib import Path

import pytest
from crcolony_deploy.doctor.compiled_code import check_compiled_code

import crcolony
from crcolony.compiled import machine_digest, source_digest
from tests.support.examined_hosts import host_of, lines

SOURCES = source_digest(Path(crcolony.__file__).parent)


def write_step(folder: Path, machine: str) -> None:
    """Write a compiled step for a machine."""
    code = folder / "cache" / f"{SOURCES}-{machine}"
    code.mkdir(parents=True)
    (code / "step-0.o").touch()


@pytest.fixture(autouse=True)
def _compiles(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NUMBA_DISABLE_JIT", raising=False)


def test_code_for_this_processor_is_found(tmp_path: Path) -> None:
    """In the services' cache."""
    write_step(tmp_path, machine_digest())
    (found,) = lines(check_compiled_code(host_of(tmp_path)))
    assert found.startswith("ok: the control step is compiled for this processor")


def test_code_for_another_processor_is_a_warning(tmp_path: Path) -> None:
    """An SD card was put into another computer."""
    write_step(tmp_path, "00000000")
    (found,) = lines(check_compiled_code(host_of(tmp_path)))
    assert found.startswith("warning: the control step is compiled for another processor")


def test_no_code_is_a_warning(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """And so is a variable that switches compiling off."""
    host = host_of(tmp_path)
    (found,) = lines(check_compiled_code(host))
    assert found.startswith("warning: the control step is not compiled yet")
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    (found,) = lines(check_compiled_code(host))
    assert found.startswith("warning: NUMBA_DISABLE_JIT is set")
