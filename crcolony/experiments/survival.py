"""Darwinian embodied evolution of the learning ability for survival (Paper III, thesis 5.3).

Runs a colony over many seeds; to compare, also with central selection and with the shaping genes switched off. The
thesis says: similar evolutionary performance as central selection; tau evolves to 0; over the runs, more matings go
with a smaller lambda of the mating module. What these runs say is printed as it is.
"""

import csv
import os
import signal
from collections.abc import Iterable
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path

import msgspec
import numpy as np

from crcolony.colony.evolve import begin, evolve
from crcolony.colony.results import ResultsError
from crcolony.compiled import FloatArray
from crcolony.config import Config

LAST = 10
"""A run's end is the mean of so many last generations."""


@dataclass(frozen=True)
class Outcome:
    """One run in numbers: per agent, at generation 0 (`first`) and as the mean of the last generations (`end`)."""

    arm: str
    seed: int
    matings_first: float
    matings_end: float
    captures_first: float
    captures_end: float
    mating_lambda_end: float
    mating_tau_end: float
    foraging_tau_end: float
    history_hash: str


def arms_of(config: Config, compare: bool) -> dict[str, Config]:
    """Return the configs to run, by name."""
    arms: dict[str, Config] = {config.selection: config}
    if compare:
        replace = msgspec.structs.replace
        arms["central"] = replace(config, selection="central")
        unshaped = replace(config.learning, shaping=False)
        arms["without shaping"] = replace(config, learning=unshaped)
    return arms


def run_once(arm: str, config: Config, folder: Path) -> Outcome:
    """Run one colony to its end into a folder; it can run in any process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    results, colony = begin(folder, config)
    rows: list[dict[str, float]] = []

    def note(_: object) -> None:
        if colony.summary and len(rows) < colony.generation:
            rows.append(colony.summary)

    evolve(results, colony, lambda: False, note)
    results.close()

    def end(name: str) -> float:
        return float(np.mean([row[name] for row in rows[-LAST:]]))

    return Outcome(
        arm=arm,
        seed=config.seed,
        matings_first=rows[0]["matings"],
        matings_end=end("matings"),
        captures_first=rows[0]["captures"],
        captures_end=end("captures"),
        mating_lambda_end=end("mating.lambda mean"),
        mating_tau_end=end("mating.tau q50"),
        foraging_tau_end=end("foraging.tau q50"),
        history_hash=str(results.hash),
    )


def run_survival(config: Config, seeds: int, out: Path, compare: bool) -> int:
    """Run all seeds of all arms in all cores, write `outcomes.csv`, and print what they say; return 0."""
    if out.exists() and any(out.iterdir()):
        raise ResultsError(f"{out}: not empty; choose another --out")
    jobs = [
        (name, msgspec.structs.replace(arm, seed=config.seed + k))
        for k in range(seeds)
        for name, arm in arms_of(config, compare).items()
    ]
    outcomes: list[Outcome] = []
    with ProcessPoolExecutor(os.cpu_count()) as executor:
        for outcome in _run_all(executor, jobs, out):
            outcomes.append(outcome)
            print(
                f"{len(outcomes)} of {len(jobs)}: {outcome.arm}, seed {outcome.seed}:"
                f" matings {outcome.matings_first:.2f} to {outcome.matings_end:.2f},"
                f" history hash: {outcome.history_hash}",
                flush=True,
            )
    outcomes.sort(key=lambda outcome: (outcome.arm, outcome.seed))
    _write(outcomes, out / "outcomes.csv")
    for line in report(outcomes):
        print(line)
    return 0


def _run_all(executor: Executor, jobs: list[tuple[str, Config]], out: Path) -> Iterable[Outcome]:
    running = [
        executor.submit(
            run_once, name, config, out / name.replace(" ", "-") / f"seed-{config.seed}"
        )
        for name, config in jobs
    ]
    try:
        for future in as_completed(running):
            yield future.result()
    except KeyboardInterrupt:
        executor.shutdown(cancel_futures=True)
        raise


def _write(outcomes: list[Outcome], path: Path) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(asdict(outcomes[0])))
        writer.writeheader()
        writer.writerows(asdict(outcome) for outcome in outcomes)


def report(outcomes: list[Outcome]) -> list[str]:
    """Return the lines that say what the runs show: means with 95 % intervals, tests, correlations."""
    from scipy.stats import mannwhitneyu

    lines = []
    arms = list(dict.fromkeys(outcome.arm for outcome in outcomes))
    ends = {arm: _column(outcomes, arm, "matings_end") for arm in arms}
    for arm in arms:
        first = _column(outcomes, arm, "matings_first")
        lines += [
            "",
            f"{arm}: {ends[arm].size} runs",
            f"  matings per agent   {_interval(first)} at generation 0, {_interval(ends[arm])}"
            f" at the end: {ends[arm].mean() / max(first.mean(), 1e-12):.1f} times",
            f"  captured batteries  {_interval(_column(outcomes, arm, 'captures_first'))} to"
            f" {_interval(_column(outcomes, arm, 'captures_end'))}",
            f"  tau at the end      mating {_interval(_column(outcomes, arm, 'mating_tau_end'))},"
            f" foraging {_interval(_column(outcomes, arm, 'foraging_tau_end'))}",
            f"  matings and lambda  {_correlation(outcomes, arm)}",
        ]
    if "implicit" in arms:
        own = ends["implicit"]
        for arm in (arm for arm in arms if arm != "implicit"):
            ratio = own.mean() / max(ends[arm].mean(), 1e-12)
            p = mannwhitneyu(own, ends[arm]).pvalue
            lines += ["", f"implicit / {arm}: {ratio:.2f} (Mann-Whitney p = {p:.2g})"]
    return lines


def _column(outcomes: list[Outcome], arm: str, name: str) -> FloatArray:
    return np.array([getattr(outcome, name) for outcome in outcomes if outcome.arm == arm])


def _interval(values: FloatArray) -> str:
    """Return mean and 95 % interval (Student's t) in words."""
    from scipy.stats import t

    if values.size < 2:
        return f"{values.mean():.2f}"
    half = t.ppf(0.975, values.size - 1) * values.std(ddof=1) / np.sqrt(values.size)
    return f"{values.mean():.2f} ± {half:.2f}"


def _correlation(outcomes: list[Outcome], arm: str) -> str:
    from scipy.stats import spearmanr

    matings = _column(outcomes, arm, "matings_end")
    if matings.size < 3:
        return "too few runs"
    found = spearmanr(matings, _column(outcomes, arm, "mating_lambda_end"))
    return f"Spearman {found.statistic:.2f} (p = {found.pvalue:.2g})"
