"""Where packages of npm are that tests use, if they are installed."""

from pathlib import Path

from tests.support.paths import ROOT

_PLACES = (
    ROOT / "node_modules",
    Path("/usr/local/lib/node_modules"),
    Path("/usr/lib/node_modules"),
)


def package_of_npm(name: str) -> Path | None:
    """Return the folder of a package, None if it is not installed."""
    return next((place / name for place in _PLACES if (place / name).exists()), None)
