"""Darwinian embodied evolution of the learning ability for survival (Paper III, thesis 5.3).

Runs a colony over many seeds; to compare, also with central selection and with the shaping genes switched off. The
thesis says: similar evolutionary performance as central selection; tau evolves to 0; over the runs, more matings go
with a smaller lambda of the mating module. What these runs say is printed as it is.
"""

import csv
import importlib.util
import json
import os
from collections.abc import Callable, Iterable
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path

import msgspec
import numpy as np

from crcolony.colony.evolve import begin, evolve, resume
from crcolony.colony.results import ResultsError, read_table
from crcolony.colony.stopping import Stop
from crcolony.compiled import FloatArray
from crcolony.config import Config, ConfigError, load

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


def run_once(arm: str, config: Config, folder: Path) -> Outcome | None:
    """Run one colony to its end into a folder, or go on with it there; it can run in any process.

    Stops after Ctrl-C, or when the process that started it is gone, and returns None then; what it did is kept.
    """
    stop, parent = Stop(None), os.getppid()
    if (folder / "config.toml").exists():
        if load(folder / "config.toml") != config:
            raise ConfigError(f"{folder / 'config.toml'}: another config than this comparison has")
        results, colony = resume(folder)
    else:
        results, colony = begin(folder, config)
    try:
        is_over = evolve(results, colony, lambda: stop() or os.getppid() != parent, lambda _: None)
    finally:
        results.close()
    return read_outcome(arm, folder) if is_over else None


def read_outcome(arm: str, folder: Path) -> Outcome:
    """Read a finished run's numbers from its folder; raises ResultsError if that is not possible."""
    try:
        run = json.loads((folder / "run.json").read_text("utf-8"))
        rows = read_table(folder / "generations.csv")

        def end(name: str) -> float:
            return float(np.mean([float(row[name]) for row in rows[-LAST:]]))

        return Outcome(
            arm=arm,
            seed=run["seed"],
            matings_first=float(rows[0]["matings"]),
            matings_end=end("matings"),
            captures_first=float(rows[0]["captures"]),
            captures_end=end("captures"),
            mating_lambda_end=end("mating.lambda mean"),
            mating_tau_end=end("mating.tau q50"),
            foraging_tau_end=end("foraging.tau q50"),
            history_hash=run["history_hash"],
        )
    except (OSError, IndexError, KeyError, TypeError, ValueError) as error:
        raise ResultsError(f"{folder}: not the results of a whole run: {error}") from None


def run_survival(config: Config, seeds: int, out: Path, compare: bool, goes_on: bool) -> int:
    """Run all seeds of all arms in all cores, write `outcomes.csv`, and print what they say; return the exit code.

    `goes_on`: runs in `out` that are done are only read, and others go on; without it `out` must be empty.
    """
    if importlib.util.find_spec("scipy") is None:
        raise ImportError("statistics need scipy: pip install 'crcolony[experiments]'")
    if not goes_on and out.exists() and any(out.iterdir()):
        raise ResultsError(f"{out}: not empty; choose another --out or use --resume")
    jobs = [
        (name, msgspec.structs.replace(arm, seed=config.seed + k))
        for k in range(seeds)
        for name, arm in arms_of(config, compare).items()
    ]
    outcomes: list[Outcome] = []
    stop = Stop(None)
    with ProcessPoolExecutor(os.cpu_count()) as executor:
        for outcome in _run_all(executor, jobs, out, stop):
            outcomes.append(outcome)
            print(
                f"{len(outcomes)} of {len(jobs)}: {outcome.arm}, seed {outcome.seed}:"
                f" matings {outcome.matings_first:.2f} to {outcome.matings_end:.2f},"
                f" history hash: {outcome.history_hash}",
                flush=True,
            )
    if len(outcomes) < len(jobs):
        print(f"stopped; go on with the same command and --resume --out {out}")
        return 0
    outcomes.sort(key=lambda outcome: (outcome.arm, outcome.seed))
    _write(outcomes, out / "outcomes.csv")
    for line in report(outcomes):
        print(line)
    return 0


def _run_all(
    executor: Executor,
    jobs: list[tuple[str, Config]],
    out: Path,
    is_stopped: Callable[[], bool],
) -> Iterable[Outcome]:
    """Yield the outcomes as they come; after a stop or an error start no more."""
    running = [
        executor.submit(
            run_once, name, config, out / name.replace(" ", "-") / f"seed-{config.seed}"
        )
        for name, config in jobs
    ]
    try:
        for future in as_completed(running):
            outcome = future.result()
            if outcome is None or is_stopped():
                break
            yield outcome
    finally:
        executor.shutdown(cancel_futures=True)


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
            p = mannwhitneyu(own, ends[arm]).pvalue
            lines += ["", f"implicit / {arm}: {_ratio(own, ends[arm])} (Mann-Whitney p = {p:.2g})"]
    return lines


def _ratio(one: FloatArray, other: FloatArray) -> str:
    """Return the ratio of two means and its 95 % interval by bootstrap (10,000 resamples, always the same)."""
    rng = np.random.default_rng(0)
    means = [rng.choice(values, (10_000, values.size)).mean(axis=1) for values in (one, other)]
    low, high = np.quantile(means[0] / np.maximum(means[1], 1e-12), [0.025, 0.975])
    return f"{one.mean() / max(other.mean(), 1e-12):.2f} ({low:.2f} to {high:.2f})"


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
