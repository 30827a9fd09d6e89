"""Watching changes nothing (promise 8): without, with a stalled or a killed viewer the colony behaves the same."""

import json
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import zenoh
from zenoh.handlers import Callback

from crcolony.protocol.key_expressions import ROOT
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import open_session
from tests.support.process import wait_until
from tests.support.process_colony import colony, settings
from tests.support.rerun_viewer import headless_viewer

HZ = 30.0
SECONDS = 4.0


def test_a_lockstep_colony_has_the_same_history_with_any_viewer(tmp_path: Path) -> None:
    """Unwatched, and watched with a viewer stalled, the dashboard stalled, and both killed, the hash is the same."""
    options = [*settings("generations=5"), "--seed", "3", "--no-plots"]
    hashes = []
    with colony(tmp_path) as made:
        evolved = made.start(
            "evolve", "evolve", "--robots", "4", *options, "--out", str(tmp_path / "evolved")
        )
        assert evolved.wait(120.0) == 0, evolved.output
        dashboard, url, _ = made.dashboard()
        with headless_viewer(url, tmp_path / "viewer.log", is_shown=False) as viewer:
            launched = made.start(
                "launch", "launch", "-n", "4", "--lockstep", *options, "--listen", made.endpoint,
                "--out", str(tmp_path / "launched"),
            )  # fmt: skip
            wait_until(lambda: viewer.until_s("sim") > 0.0, "the viewer shows the colony")
            viewer.process.signal(signal.SIGSTOP)
            wait_until(_has_begun(tmp_path, 2), "two generations with a stalled viewer")
            dashboard.signal(signal.SIGSTOP)
            wait_until(_has_begun(tmp_path, 3), "one more with a stalled dashboard")
            viewer.process.kill()
            dashboard.kill()
            assert launched.wait(120.0) == 0, launched.output
    for run in ("evolved", "launched"):
        run_json = json.loads((tmp_path / run / "run.json").read_text())
        hashes.append(run_json["history_hash"])
    assert hashes[0] == hashes[1]


def _has_begun(folder: Path, generation: int) -> Callable[[], bool]:
    """Return a condition: a lockstep colony has begun a generation, by its robots' logs."""
    logs = folder / "launched" / "logs"

    def has_started() -> bool:
        texts = [log.read_text() for log in logs.glob("robot-*.log")]
        return bool(texts) and all(f"generation {generation}" in text for text in texts)

    return has_started


@pytest.fixture
def periods() -> Callable[[zenoh.Session, float], np.ndarray]:
    """Return a function that measures the control periods (s) of all bodies for some seconds, by their actions."""

    def measure(session: zenoh.Session, seconds: float) -> np.ndarray:
        at: dict[str, list[float]] = {}

        def on_action(sample: zenoh.Sample) -> None:
            at.setdefault(str(sample.key_expr), []).append(time.monotonic())

        subscriber = session.declare_subscriber(
            f"{ROOT}/arena/*/body/*/action", Callback(on_action, indirect=False)
        )
        time.sleep(seconds)  # what is measured is time
        subscriber.undeclare()  # type: ignore[no-untyped-call]
        return np.concatenate([np.diff(times) for times in at.values() if len(times) > 2])

    return measure


@pytest.mark.alone
def test_robots_keep_their_control_period_with_any_viewer(
    tmp_path: Path, periods: Callable[[zenoh.Session, float], np.ndarray]
) -> None:
    """At 30 Hz the median period is the same, and hardly one is missed, without, with a stalled and a killed viewer."""
    with colony(tmp_path) as made:
        made.arena(4, "--hz", str(HZ))
        # What goes over the network can be measured from outside.
        robots = [made.robot("--no-shared-memory") for _ in range(4)]
        with open_session(NetworkSettings(connect=(made.endpoint,))) as session:
            for robot in robots:
                robot.wait_for("has body")
            unwatched = periods(session, SECONDS)
            dashboard, url, _ = made.dashboard()
            with headless_viewer(url, tmp_path / "viewer.log") as viewer:
                wait_until(lambda: viewer.until_s("sim") > 0.0, "the viewer shows the colony")
                viewer.process.signal(signal.SIGSTOP)
                stalled_viewer = periods(session, SECONDS)
                dashboard.signal(signal.SIGSTOP)
                stalled_dashboard = periods(session, SECONDS)
                viewer.process.kill()
                dashboard.kill()
            killed = periods(session, SECONDS)
    for watched in (stalled_viewer, stalled_dashboard, killed):
        assert abs(float(np.median(watched)) - float(np.median(unwatched))) < 0.05 / HZ
        least = 0.97 * SECONDS * HZ * 4
        assert len(watched) > least, "no control periods were skipped"
        print(f"p99 {np.quantile(watched, 0.99):.4f} s", file=sys.stderr)
