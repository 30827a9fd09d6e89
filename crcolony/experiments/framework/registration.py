"""What an experiment claims, and how that will be judged, written down before it runs.

It is a file `claims/NAME.toml` beside the experiment, of which every results folder gets a copy before the first run:

    summary = "One sentence: what the experiment does."
    source = "Where the claims come from."
    seeds = 20                  # by default

    [[claim]]
    id = "parity"
    claim = "What should be seen, in a sentence."
    thesis = "What the thesis or the paper says."
    quantity = "What is measured, with its unit."
    test = "How it is judged."
    threshold = 0.9             # of the quantity or of the test, as `test` says
    seeds = 20                  # with fewer there is no verdict
"""

import tomllib
from importlib.resources import files
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from crcolony.storage.files import FolderError

_Text = Annotated[str, Meta(min_length=1)]
_Count = Annotated[int, Meta(ge=1)]


class Claim(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A claim, and how it is judged."""

    id: _Text
    claim: _Text
    thesis: _Text
    """What the thesis or the paper says"""
    quantity: _Text
    test: _Text
    threshold: float
    seeds: _Count
    """Below so many there is no verdict that counts"""
    tried: str = ""
    """Of one that does not reproduce: what was tried. This alone may be written afterwards"""


class Registration(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """All claims of an experiment."""

    summary: _Text
    source: _Text
    seeds: _Count
    """By default"""
    claims: tuple[Claim, ...] = msgspec.field(name="claim")

    @property
    def has_statistics(self) -> bool:
        """Whether a claim is one about several runs."""
        return any(claim.seeds > 1 for claim in self.claims)


def registered_names() -> list[str]:
    """Return the names of all experiments, in order."""
    names = [
        Path(entry.name) for entry in files("crcolony.experiments").joinpath("claims").iterdir()
    ]
    return sorted(name.stem for name in names if name.suffix == ".toml")


def registration_text(name: str) -> str:
    """Return the registration of an experiment as it is in the package."""
    return files("crcolony.experiments").joinpath("claims", f"{name}.toml").read_text("utf-8")


def parse_registration(text: str) -> Registration:
    """Return a registration; raises ValueError (of tomllib or msgspec) for one that is wrong."""
    found = msgspec.convert(tomllib.loads(text), Registration)
    ids = [claim.id for claim in found.claims]
    if len(set(ids)) < len(ids):
        raise ValueError("two claims have the same id")
    return found


def read_registration(path: Path) -> Registration:
    """Read the copy in a results folder; raises FolderError."""
    try:
        return parse_registration(path.read_text("utf-8"))
    except OSError as error:
        raise FolderError(f"{path}: cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise FolderError(f"{path}: corrupt: {error}") from None
