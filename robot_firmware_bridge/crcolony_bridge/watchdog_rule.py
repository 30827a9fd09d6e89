"""The rule that a robot is not driven whose wheels nothing stops when this machine dies, unless a person allows it."""

from crcolony_bridge.driver import RobotDescription
from crcolony_bridge.errors import DeviceError

ALLOWED_BY = "--without-watchdog"


def check_watchdog(name: str, robot: RobotDescription, *, is_needed: bool) -> None:
    """Raise DeviceError, with what a person can do, for a connected robot without a watchdog if it needs one."""
    if is_needed and robot.watchdog == "none":
        raise DeviceError(
            f"{name}: nothing stops its wheels when this machine dies; if it can do no harm: {ALLOWED_BY}"
        )
