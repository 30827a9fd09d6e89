"""What signatures cost a robot that tells observers its state, and an observer of a thousand robots.

Run with `make bench`, or `python -m tests.benchmarks.bench_signed_telemetry`. Figures are the processor's time in this
process. The baseline is the bare signature, made and verified, of a message of that size.
"""

import statistics
import time
from collections.abc import Callable

from crcolony.nodes.node_inputs import STATE_PERIOD_S
from crcolony.protocol.codec import encode
from crcolony.protocol.identity import is_signed, seeded
from crcolony.protocol.key_expressions import ColonyKeys
from crcolony.protocol.signed_telemetry import purpose_of_robot, sign_telemetry
from crcolony.telemetry.sample_verifier import SampleVerifier
from crcolony.telemetry.samples import RawSample
from tests.vectors.make import TELEMETRY

ROBOTS, SECONDS, TURNS = 1000, 10, 5
EVENTS_PER_S = 0.3
"""Of a robot that mates 200 times in a generation, at ten control periods a second: three events a mating"""
COLONY = "bench"
OF_ROBOT, OF_DASHBOARD = 0.001, 0.05
"""Targets, of a core"""


def main() -> None:
    content, purpose = encode(TELEMETRY["state"]), purpose_of_robot(COLONY)
    robots = [seeded(COLONY, 1, number) for number in range(ROBOTS)]
    some = robots[0]
    signature = some.sign(content)
    sign_s = cost_s(lambda: some.sign(content))
    verify_s = cost_s(lambda: is_signed(content, signature, some.public_key))
    count = iter(range(10**9))
    ours_s = cost_s(lambda: sign_telemetry(content, purpose, some, next(count)))
    robot = ours_s * (1.0 / STATE_PERIOD_S + EVENTS_PER_S)
    print(f"a robot: {100 * robot:.3f} % of a core  (target {100 * OF_ROBOT} %)")
    print(
        f"  signing {1e6 * ours_s:.0f} us, bare {1e6 * sign_s:.0f} us (ratio {ours_s / sign_s:.2f})"
    )
    keys = ColonyKeys(COLONY)
    verifier, used_s = SampleVerifier(), []
    for second in range(SECONDS):
        samples = [
            RawSample(
                "state", keys.state(robot.id), sign_telemetry(content, purpose, robot, turn), 0
            )
            for turn in (2 * second, 2 * second + 1)
            for robot in robots
        ] + [
            RawSample("event", keys.event(robot.id), sign_telemetry(content, purpose, robot), 0)
            for robot in robots[: round(EVENTS_PER_S * ROBOTS)]
        ]
        began_s = time.process_time()
        believed = sum(1 for _ in verifier.open_all(float(second), samples))
        used_s.append(time.process_time() - began_s)
    observer = statistics.median(used_s)
    print(
        f"an observer of {ROBOTS} robots: {100 * observer:.1f} % of a core  (target {100 * OF_DASHBOARD:g} %)\n"
        f"  {believed} messages verified a second, {1e6 * observer / believed:.0f} us each,"
        f" bare {1e6 * verify_s:.0f} us (ratio {observer / believed / verify_s:.2f})"
    )


def cost_s(action: Callable[[], object], times: int = 2000) -> float:
    turns = []
    for _ in range(TURNS):
        began_s = time.process_time()
        for _ in range(times):
            action()
        turns.append((time.process_time() - began_s) / times)
    return statistics.median(turns)


if __name__ == "__main__":
    main()
