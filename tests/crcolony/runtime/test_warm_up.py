"""The control step is compiled once, however many processes need it, and all of them know how far it is."""

import os
import threading
from pathlib import Path

import pytest

import crcolony.runtime.warm_up as module
from crcolony.config import Config
from crcolony.protocol.telemetry_messages import decode_activity
from crcolony.robot.aot_step import machine_code_path
from crcolony.runtime.startup_report import StartupReport
from crcolony.runtime.warm_up import COMPILING_STEP, any_robot, warm_up
from tests.support.process import wait_until

STEP = machine_code_path(*any_robot(Config()))
pytestmark = pytest.mark.skipif(STEP is None, reason="nothing is compiled here")


def test_a_step_that_is_compiled_already_is_only_loaded() -> None:
    """Nothing is reported."""
    lines = list[str]()
    with StartupReport(lambda data: None, lines.append) as report:
        warm_up(*any_robot(Config()), report)  # compiles, if no test has done it
        lines.clear()
        warm_up(*any_robot(Config()), report)
    assert not lines


def test_a_process_that_waits_for_another_shows_its_progress(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Until the other has compiled the step; then it loads it without compiling."""
    import fcntl

    path = tmp_path / "step.o"
    monkeypatch.setattr(module, "machine_code_path", lambda *_: path)
    path.with_suffix(".progress").write_text("[6, 24]")
    published = list[bytes]()
    with path.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        with StartupReport(published.append, lambda line: None) as report:
            waiting = threading.Thread(target=warm_up, args=(*any_robot(Config()), report))
            waiting.start()
            wait_until(lambda: published, "it reports")
            assert waiting.is_alive()
            activity = decode_activity(published[-1])
            assert (activity.doing, activity.done, activity.total) == (COMPILING_STEP, 6, 24)
            path.write_bytes(b"")
            fcntl.flock(lock, fcntl.LOCK_UN)
            waiting.join(60.0)
            assert not waiting.is_alive()


def test_progress_that_cannot_be_read_is_unknown(tmp_path: Path) -> None:
    """It is not written yet, or is no progress."""
    assert module._read_progress(tmp_path / "missing") == (0, 0)
    for text in ("", "[1]", '["a", 2]', "{}"):
        (tmp_path / "file").write_text(text)
        assert module._read_progress(tmp_path / "file") == (0, 0), text
    assert os.listdir(tmp_path) == ["file"]
