"""Runs an experiment into its results folder, or goes on in one, and prints each claim beside what was measured."""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import msgspec
from rich.console import Console

from crcolony.errors import EXIT_OK
from crcolony.experiments.framework.catalogue import ExperimentError
from crcolony.experiments.framework.experiment import Experiment, Job, Plan, Row
from crcolony.experiments.framework.experiment_folder import (
    Description,
    ExperimentFolder,
    JobKey,
    key_of,
    tidy_rows,
    versions,
)
from crcolony.experiments.framework.experiment_progress import JobProgress
from crcolony.experiments.framework.measured_claims import (
    format_claims,
    measure_claims,
    write_claims,
)
from crcolony.experiments.framework.registration import Registration, parse_registration
from crcolony.experiments.framework.tidy_table import (
    check_needed_packages,
    checked_rows,
    write_rows,
)
from crcolony.experiments.pools.finished_jobs import finished_jobs
from crcolony.experiments.pools.worker_pool import OpenPool
from crcolony.shutdown import ShutdownSignal
from crcolony.storage.claimed_folder import ClaimedFolder, claim_folder
from crcolony.storage.files import FolderError
from crcolony.terminal import plain_console

QUICK_SEEDS = 3
"""Seeds of a quick run: the fewest of which there are intervals."""


@dataclass(frozen=True)
class Request:
    """What a user asks for; None: as registered, or as the folder has it that is resumed."""

    seeds: int | None = None
    first_seed: int | None = None
    is_quick: bool = False
    out: Path | None = None
    """None: the next free runs/N"""
    is_resumed: bool = False


def run_experiment(
    experiment: Experiment, registration: str, request: Request, open_pool: OpenPool
) -> int:
    """Run all jobs that are not finished yet, write and print what was found, and return the exit code.

    `registration` is TOML. Raises ExperimentError, FolderError, the errors of the pool, and ImportError if a package is
    missing; what was finished by then is in the folder.
    """
    check_needed_packages()
    _check_seeds(request, parse_registration(registration))
    with claim_folder(request.out, "experiment") as claimed:
        folder = ExperimentFolder(claimed.path)
        try:
            description = _begin(folder, claimed, experiment, registration, request)
        except BaseException:
            if claimed.is_new:
                claimed.discard()
            raise
        return _run_jobs(experiment, folder, description, open_pool)


def _check_seeds(request: Request, registration: Registration) -> None:
    """Raise ExperimentError for fewer seeds than there can be statistics of, or none."""
    if request.seeds is None:
        return
    least = 2 if registration.has_statistics else 1
    if request.seeds < least:
        why = "; its claims are about several runs" if least > 1 else ""
        raise ExperimentError(f"--seeds {request.seeds}: must be at least {least}{why}")


def _begin(
    folder: ExperimentFolder,
    claimed: ClaimedFolder,
    experiment: Experiment,
    registration: str,
    request: Request,
) -> Description:
    """Begin in a new folder, or check that one that is resumed is of this experiment; return what is run in it."""
    if not claimed.is_new:
        return _resumed(folder, experiment, request)
    if request.is_resumed:
        raise FolderError(f"{folder.path}: there is nothing to resume")
    default = QUICK_SEEDS if request.is_quick else parse_registration(registration).seeds
    description = Description(
        experiment.name,
        1 if request.first_seed is None else request.first_seed,
        default if request.seeds is None else request.seeds,
        request.is_quick,
        0,
        versions=versions(),
    )
    description = msgspec.structs.replace(description, jobs=len(_jobs(experiment, description)))
    claimed.begin()
    folder.begin(description, registration)
    return description


def _resumed(folder: ExperimentFolder, experiment: Experiment, request: Request) -> Description:
    if not request.is_resumed:
        raise FolderError(
            f"{folder.path}: made by crcolony experiment; to go on with it: {_resume_command(folder)}"
        )
    begun = folder.description()
    for option, asked, was in (
        ("the experiment", experiment.name, begun.experiment),
        ("--seeds", request.seeds, begun.seeds),
        ("--seed", request.first_seed, begun.first_seed),
        ("--quick", request.is_quick or None, begun.is_quick),
    ):
        if asked not in (None, was):
            raise FolderError(
                f"{folder.path}: cannot be resumed with another value of {option}: it was {was}"
            )
    if len(_jobs(experiment, begun)) != begun.jobs:
        raise FolderError(
            f"{folder.path}: has {begun.jobs} runs, and this version of {experiment.name} another number"
        )
    return begun


def _jobs(experiment: Experiment, description: Description) -> Sequence[Job]:
    seeds = range(description.first_seed, description.first_seed + description.seeds)
    jobs = experiment.jobs(Plan(seeds, description.is_quick))
    assert len({key_of(job) for job in jobs}) == len(jobs), "two jobs of one condition and seed"
    return jobs


def _run_jobs(
    experiment: Experiment, folder: ExperimentFolder, description: Description, open_pool: OpenPool
) -> int:
    """Run what is not in the folder yet, and report if all is finished then."""
    console = plain_console()
    jobs = _jobs(experiment, description)
    journal = folder.read_journal()
    if not journal.keys() <= {key_of(job) for job in jobs}:
        raise FolderError(f"{folder.path}: holds runs that {experiment.name} does not have")
    console.print(f"{_headline(description)}, into {folder.path}", soft_wrap=True)
    with ShutdownSignal() as stop:
        waiting = [job for job in jobs if key_of(job) not in journal]
        progress = JobProgress(console, len(jobs), len(journal))
        if waiting:
            with open_pool(len(waiting), stop) as pool, progress.show():
                calls = (pool.wrap(partial(_run_job, job)) for job in waiting)
                for key, result in finished_jobs(pool.executor, pool.workers, calls, stop):
                    journal[key] = checked_rows(result, experiment.columns)
                    folder.append(key, journal[key])
                    progress.add(key)
        if len(journal) == len(jobs):
            with stop.interruptible():
                _report(console, experiment, folder, description, tidy_rows(journal, jobs))
                return EXIT_OK
    console.print(f"stopped; resume with: {_resume_command(folder)}", soft_wrap=True)
    return EXIT_OK


def _headline(description: Description) -> str:
    last = description.first_seed + description.seeds - 1
    quick = ", quick: no claims" * description.is_quick
    return f"{description.experiment}: {description.jobs} runs, seeds {description.first_seed} to {last}{quick}"


def _run_job(job: Job) -> tuple[JobKey, Row | Sequence[Row]]:
    return key_of(job), job.run()


def _report(
    console: Console,
    experiment: Experiment,
    folder: ExperimentFolder,
    description: Description,
    rows: Sequence[Row],
) -> None:
    """Write rows, claims and figure, mark the folder as complete, and print the claims."""
    from crcolony.results.plots.style import style, write_figure

    found = measure_claims(experiment, folder.registration(), rows)
    try:
        write_rows(folder.path, rows, experiment.columns)
        write_claims(folder.path, found, description.is_quick)
    except OSError as error:
        raise FolderError(f"{folder.path}: cannot be written: {error.strerror}") from None
    with style():
        figure = write_figure(experiment.draw(rows), folder.path / f"{experiment.name}.png")
    folder.describe(msgspec.structs.replace(description, is_complete=True))
    console.print()
    columns = console.width if console.is_terminal else None
    for line in format_claims(found, description.seeds, columns):
        console.print(line, soft_wrap=True)
    if description.is_quick:
        console.print("a quick run: it shows that the experiment runs, and nothing of its claims")
    console.print(f"data and figure: {figure.parent}", soft_wrap=True)


def _resume_command(folder: ExperimentFolder) -> str:
    name = folder.description().experiment
    return f"crcolony experiment {name} --resume --out {shlex.quote(str(folder.path))}"
