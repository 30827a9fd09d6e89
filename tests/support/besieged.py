"""What a colony withstands: the bounds within which its matings, control periods and memory stay under an attack."""

import statistics
from dataclasses import dataclass, field

from crcolony.protocol.telemetry_messages import RobotState
from tests.support.attack import HZ, Figures, Siege

CALM_S = 0.5
"""How long is measured without an attack."""
ATTACK_S = 2.0
MIN_MATED = 0.8
"""Of the share of encounters that become matings without an attack; the promise is 0.9."""
MAX_LATE_PERIODS = 1.5
"""How much the 99th percentile of control periods may grow under attack, in periods."""
MAX_GROWN_MIB = 40.0
ATTEMPTS = 3
"""A busy machine may delay a few control steps; an attack that delays them does so in each attempt."""


@dataclass
class Besieged:
    """A colony under siege, and its measurements without an attack so far."""

    siege: Siege
    calm: list[Figures] = field(default_factory=list)

    def withstands(self, attack: str) -> tuple[Figures, list[RobotState]]:
        """Run an attack and check what holds under any; return the measurements, and the states before it."""
        before = self.states()
        self.calm.append(self.siege.monitor(CALM_S))
        share = statistics.mean(figures.mated_share for figures in self.calm)
        latest_ms = statistics.mean(figures.period_ms[1] for figures in self.calm)
        latest_ms += MAX_LATE_PERIODS * 1000.0 / HZ
        with self.siege.attacked(attack):
            for _ in range(ATTEMPTS):
                during = self.siege.monitor(ATTACK_S)
                assert during.grown_mib <= MAX_GROWN_MIB, during
                if during.mated_share >= MIN_MATED * share and during.period_ms[1] <= latest_ms:
                    break
        for process in self.siege.honest:
            assert process.is_running, process.output[-2000:]
        assert during.mated_share >= MIN_MATED * share > 0.0, during
        assert during.period_ms[1] <= latest_ms, during
        return during, before

    def states(self) -> list[RobotState]:
        """Return the last states of the robots."""
        self.siege.view.update()
        return [self.siege.view.states[robot.id] for robot in self.siege.made.robots]

    def refuses(self, attack: str) -> None:
        """Run an attack whose envelopes the robots count as refused."""
        _, before = self.withstands(attack)
        for robot, earlier in zip(self.states(), before, strict=True):
            assert robot.refused > earlier.refused
