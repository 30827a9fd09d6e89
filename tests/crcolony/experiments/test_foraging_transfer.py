"""The experiment on foraging: what its runs are, and what a run leaves."""

from crcolony.experiments.colonies.foraging_lives import BODIES, WINDOWS
from crcolony.experiments.foraging_transfer import EXPERIMENT
from crcolony.experiments.foraging_transfer_claims import BOTH, META_ALONE
from crcolony.experiments.framework.experiment import CONDITION, SEED, Plan, Row


def test_a_quick_run_has_all_columns_and_a_figure() -> None:
    """Of both conditions, in all bodies; the thirds of a life are all of it."""
    rows: list[Row] = []
    for job in EXPERIMENT.jobs(Plan([7], True)):
        found = job.run()
        rows += [{CONDITION: job.condition, SEED: job.seed, **row} for row in found]  # type: ignore[dict-item]
    assert {name for row in rows for name in row} - {CONDITION, SEED} == set(EXPERIMENT.columns)
    for condition in (BOTH, META_ALONE):
        own = [row for row in rows if row[CONDITION] == condition]
        (found,) = [row for row in own if "life_own" in row]
        assert sum("window" in row for row in own) == WINDOWS
        for body in BODIES:
            thirds = [float(found[f"{third}_{body}"]) for third in ("first", "second", "last")]
            assert abs(sum(thirds) - float(found[f"life_{body}"])) < 1e-9
    labels = [line.get_label() for line in EXPERIMENT.draw(rows).axes[0].lines]
    assert labels == ["own body", "worn", "delayed", "own, meta-parameters alone"]
