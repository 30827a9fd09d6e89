"""Whether this host's clock is right: against the clocks of robots on other hosts, and by its synchronisation."""

from collections.abc import Iterator
from statistics import median

from crcolony_deploy.doctor.finding import Finding, ok, problem, warning
from crcolony_deploy.doctor.host_state import HostState, output_of

MAX_OFFSET_S = 60.0
"""More than this, and certificates and logs go wrong."""
_NOTED_OFFSET_S = 2.0
_REMEDY = "timedatectl set-ntp true"


def check_clock(host: HostState) -> Iterator[Finding]:
    """Compare the times in states of robots of other hosts with the times at which they arrive."""
    own = set(host.own_robots.values())
    offsets_s = [
        offset_s for robot, offset_s in host.colony.clock_offsets_s.items() if robot not in own
    ]
    # The middle of many: of two clocks that differ, the one that differs from most others is wrong.
    offset_s = median(offsets_s) if offsets_s else 0.0
    direction = "behind" if offset_s > 0.0 else "ahead of"
    text = f"this clock is {abs(offset_s):.0f} s {direction} those of {len(offsets_s)} robots elsewhere"
    if abs(offset_s) > MAX_OFFSET_S:
        yield problem(text, _REMEDY)
    elif abs(offset_s) > _NOTED_OFFSET_S:
        yield warning(text, _REMEDY)
    elif offsets_s:
        yield ok(f"the clock agrees with those of {len(offsets_s)} robots elsewhere")
    synchronised = output_of("timedatectl", "show", "-p", "NTPSynchronized", "--value")
    if synchronised is not None and synchronised.strip() == "no":
        yield warning("the clock is not synchronised", _REMEDY)
