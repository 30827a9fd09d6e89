"""Finds drivers by their name: those of this package, and those that other installed packages bring."""

from collections.abc import Callable
from importlib.metadata import EntryPoint, entry_points

from crcolony.errors import did_you_mean
from crcolony_bridge.driver import Driver
from crcolony_bridge.errors import DeviceError

GROUP = "crcolony_bridge.drivers"
"""The entry-point group; each entry is something to call with an address, which returns a `Driver`."""


def installed_drivers() -> dict[str, EntryPoint]:
    """Return the entry points of all drivers by name, in alphabetical order."""
    found = {point.name: point for point in entry_points(group=GROUP)}
    return dict(sorted(found.items()))


def make_driver(robot: str) -> Driver:
    """Return the driver of a robot that is given as DRIVER@ADDRESS; raises DeviceError for what is none."""
    name, _, address = robot.partition("@")
    if not name or not address:
        raise DeviceError(
            f"--robot {robot}: expected DRIVER@ADDRESS, as in firmware@/dev/ttyACM0 or aseba@tcp:127.0.0.1:33333"
        )
    drivers = installed_drivers()
    if name not in drivers:
        known = ", ".join(drivers) or "none"
        raise DeviceError(
            f"--robot {robot}: no driver is called {name}{did_you_mean(name, drivers)}; installed: {known}"
        )
    try:
        make: Callable[[str], Driver] = drivers[name].load()
    except Exception as error:  # whatever a package from elsewhere does when it is imported
        package = drivers[name].value
        raise DeviceError(f"--robot {robot}: {package} cannot be used: {error!r}") from None
    return make(address)
