"""What certificates cost a running colony: a hundred renewals over ten robots, and how fast a revocation is known.

Run with `make bench`, or `python -m tests.benchmarks.bench_renewal`. A gap is the longest time between two actions of a
robot within three seconds of the renewal of its own certificate, as another member of the deployment receives them.
"""

import itertools
import statistics
import tempfile
import time
from collections import defaultdict
from pathlib import Path

import zenoh

from crcolony.protocol.key_expressions import ArenaKeys
from crcolony.transport.zenoh_samples import callback
from tests.support.secured_colony import SecuredColony, secured_colony

ROBOTS, RENEWALS, HZ = 10, 100, 20.0
CALM_S = 5.0
_AFTER_S = 3.0


class Actions:
    """When the actions of each robot arrive."""

    def __init__(self, session: zenoh.Session) -> None:
        self.arrivals_s: defaultdict[str, list[float]] = defaultdict(list)
        self._subscriber = session.declare_subscriber(
            ArenaKeys("arena").all_actions, callback(self._on_action)
        )

    def _on_action(self, sample: zenoh.Sample) -> None:
        self.arrivals_s[str(sample.key_expr)].append(time.monotonic())

    def gaps_s(self, key: str, since_s: float, until_s: float) -> list[float]:
        """Return the times between two actions of a robot."""
        times = [at_s for at_s in list(self.arrivals_s[key]) if since_s <= at_s <= until_s]
        return [after - before for before, after in itertools.pairwise(times)]


def percentile(values: list[float], share: float) -> float:
    """Return the smallest value that this share of all values does not exceed."""
    return sorted(values)[min(int(share * len(values)), len(values) - 1)]


def report(name: str, gaps_s: list[float]) -> None:
    """Print a line about gaps."""
    median_ms, p99_ms, most_ms = (
        1000.0 * value
        for value in (statistics.median(gaps_s), percentile(gaps_s, 0.99), max(gaps_s))
    )
    print(
        f"{name}: median {median_ms:.0f} ms, p99 {p99_ms:.0f} ms, at most {most_ms:.0f} ms",
        flush=True,
    )


def renewals(secured: SecuredColony, actions: Actions) -> None:
    """Renew one robot's certificate a second, and report the gaps."""
    key_of = {
        credentials: ArenaKeys("arena").action(robot.id)
        for credentials, robot in zip(secured.credentials, secured.made.robots, strict=True)
    }
    started_s = time.monotonic()
    time.sleep(CALM_S)
    calm = [max(actions.gaps_s(key, started_s, time.monotonic())) for key in key_of.values()]
    report(f"without renewals, the longest gap of each robot in {CALM_S:g} s", calm)
    before = secured.made.outcomes()
    renewed: list[tuple[str, float]] = []
    for number in range(RENEWALS):
        credentials = secured.credentials[number % ROBOTS]
        renewed.append((key_of[credentials], time.monotonic()))
        secured.deployment.renew(credentials)
        time.sleep(1.0)
    time.sleep(_AFTER_S)
    longest = [max(actions.gaps_s(key, at_s - 0.2, at_s + _AFTER_S)) for key, at_s in renewed]
    report(f"{RENEWALS} renewals over {ROBOTS} robots at {HZ:g} Hz, longest gap", longest)
    print(f"encounters meanwhile: {dict(secured.made.outcomes() - before)}", flush=True)
    lost = sum(robot.output.count("has body") - 1 for robot in secured.made.robots)
    print(f"bodies lost: {lost}", flush=True)


def revocation(secured: SecuredColony) -> None:
    """Revoke a robot; report how soon all others had the roster after the first."""
    secured.operate("revoke", "robot0")
    known_s = [(folder / "roster").stat().st_mtime for folder in secured.credentials]
    spread_ms = 1000.0 * (max(known_s) - min(known_s))
    print(
        f"a revocation is known to all {ROBOTS} robots {spread_ms:.0f} ms after the first",
        flush=True,
    )


def main() -> None:
    """Print the figures."""
    with (
        tempfile.TemporaryDirectory() as folder,
        secured_colony(Path(folder), ROBOTS, HZ, spare_slots=0) as secured,
    ):
        watching = secured.insider("router", "bench")
        with secured.open_session(watching) as session:
            renewals(secured, Actions(session))
        revocation(secured)


if __name__ == "__main__":
    main()
