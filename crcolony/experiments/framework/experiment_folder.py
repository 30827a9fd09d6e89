"""The results folder of an experiment, from which it goes on wherever it was stopped.

made_by.toml            what made the folder
experiment.json         which experiment, with which seeds, and whether it is complete
claims.toml             the claims as they were before the first run
jobs.jsonl              the rows of every finished job, a line each, on the disk before the next is counted
rows.parquet            all rows, when it is complete
data_dictionary.json    what their columns mean
claims.json             what was measured
NAME.png                the figure
"""

import json
import os
import platform
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path

import msgspec

from crcolony.durable_files import replace_file
from crcolony.experiments.framework.experiment import CONDITION, SEED, Job, Row
from crcolony.experiments.framework.registration import Registration, read_registration
from crcolony.storage.files import FolderError

DESCRIPTION_FILE = "experiment.json"
REGISTRATION_FILE = "claims.toml"
JOURNAL_FILE = "jobs.jsonl"

JobKey = tuple[str, int]
"""Condition and seed of a job."""


class Description(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What is run in a folder."""

    experiment: str
    first_seed: int
    seeds: int
    is_quick: bool
    """Its results are no claims"""
    jobs: int
    is_complete: bool = False
    versions: dict[str, str] = {}


def versions() -> dict[str, str]:
    """Return the versions that results may depend on."""
    packages = ("crcolony", "numpy", "numba", "scipy")
    return {"python": platform.python_version(), **{name: version(name) for name in packages}}


def key_of(job: Job) -> JobKey:
    """Return what tells a job from all others of its experiment."""
    return job.condition, job.seed


class ExperimentFolder:
    """Reads and writes a folder that this process has claimed; raises FolderError if a file is wrong."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def begin(self, description: Description, registration: str) -> None:
        """Write into a new folder what will be run, and what is claimed of it (TOML)."""
        self._replace(REGISTRATION_FILE, registration.encode())
        self._replace(JOURNAL_FILE, b"")
        self.describe(description)

    def describe(self, description: Description) -> None:
        """Write what is run, or that it is complete."""
        encoded = msgspec.json.format(msgspec.json.encode(description))
        self._replace(DESCRIPTION_FILE, encoded)

    def append(self, key: JobKey, rows: Sequence[Row]) -> None:
        """Write the rows of a finished job; they are on the disk when this returns."""
        line = json.dumps({CONDITION: key[0], SEED: key[1], "rows": rows}) + "\n"
        try:
            with (self.path / JOURNAL_FILE).open("ab") as file:
                file.write(line.encode())
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            raise FolderError(f"{error.filename or self.path}: {error.strerror}") from None

    def read_journal(self) -> dict[JobKey, list[Row]]:
        """Return the rows of all finished jobs; a last line that a crash cut short is deleted."""
        path = self.path / JOURNAL_FILE
        try:
            content = path.read_bytes()
            whole = content[: content.rfind(b"\n") + 1]
            if len(whole) < len(content):
                os.truncate(path, len(whole))
        except OSError as error:
            raise FolderError(f"{path}: cannot be read: {error.strerror}") from None
        try:
            lines = [json.loads(line) for line in whole.splitlines()]
            return {(line[CONDITION], line[SEED]): line["rows"] for line in lines}
        except (ValueError, KeyError, TypeError) as error:
            raise FolderError(f"{path}: corrupt: {error}") from None

    def registration(self) -> Registration:
        """Return what was claimed before the first run."""
        return read_registration(self.path / REGISTRATION_FILE)

    def description(self) -> Description:
        """Return what is run here."""
        path = self.path / DESCRIPTION_FILE
        try:
            return msgspec.json.decode(path.read_bytes(), type=Description)
        except FileNotFoundError:
            raise FolderError(
                f"{self.path}: not the results of an experiment: {path.name} is missing"
            ) from None
        except OSError as error:
            raise FolderError(f"{path}: cannot be read: {error.strerror}") from None
        except msgspec.DecodeError as error:
            raise FolderError(f"{path}: corrupt: {error}") from None

    def _replace(self, name: str, content: bytes) -> None:
        try:
            replace_file(self.path / name, lambda file: file.write(content))
        except OSError as error:
            raise FolderError(f"{self.path / name}: cannot be written: {error.strerror}") from None


def tidy_rows(journal: Mapping[JobKey, Sequence[Row]], jobs: Sequence[Job]) -> list[Row]:
    """Return the rows of finished jobs in the order of the jobs, each with its condition and seed."""
    return [
        {CONDITION: job.condition, SEED: job.seed, **row}
        for job in jobs
        for row in journal[key_of(job)]
    ]
